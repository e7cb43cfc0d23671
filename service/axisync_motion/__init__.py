"""Synchronised jerk-limited motion of many axes: MASA, trajectories, the path clock. Needs numpy; numba is optional."""

from .backends import backend, use_backend
from .batch import synchronise_batch
from .errors import InfeasibleDuration, InvalidLimits
from .from_profiles import from_profiles
from .inverse import Minimise, lowest_acceleration, lowest_jerk, lowest_velocity
from .masa import SyncProfile, synchronise
from .path_clock import PathClock, derivatives
from .recursion import recursion, sample_count
from .s_curve import Profile, Pulse
from .stop_table import StopTable, stop_table
from .time_optimal import duration, max_distance, time_optimal
from .trajectory import Evaluator, Trajectory, concatenate

__all__ = [
    "Evaluator",
    "InfeasibleDuration",
    "InvalidLimits",
    "Minimise",
    "PathClock",
    "Profile",
    "Pulse",
    "StopTable",
    "SyncProfile",
    "Trajectory",
    "backend",
    "concatenate",
    "derivatives",
    "duration",
    "from_profiles",
    "lowest_acceleration",
    "lowest_jerk",
    "lowest_velocity",
    "max_distance",
    "recursion",
    "sample_count",
    "stop_table",
    "synchronise",
    "synchronise_batch",
    "time_optimal",
    "use_backend",
]
