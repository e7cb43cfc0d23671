"""Synchronised jerk-limited motion of many axes: MASA, trajectories, the path clock. Needs numpy; numba is optional."""

from .backends import backend, use_backend
from .batch import synchronise_batch
from .errors import InfeasibleDuration, InvalidLimits
from .from_profiles import from_profiles
from .inverse import Minimise, lowest_acceleration, lowest_jerk, lowest_velocity
from .masa import SyncProfile, synchronise
from .path_clock import PathClock, derivatives
from .rate_tables import RateTables, rate_tables
from .recursion import recursion, sample_count
from .s_curve import Profile, Pulse
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
    "RateTables",
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
    "rate_tables",
    "recursion",
    "sample_count",
    "synchronise",
    "synchronise_batch",
    "time_optimal",
    "use_backend",
]
