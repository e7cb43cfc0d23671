"""Which of two implementations plans: numba's compiled one (the extra `fast`), or Python with numpy. Same results.

Nothing is chosen, and numba not imported, before something is planned: evaluating trajectories needs neither.
"""

import logging
import os
from collections.abc import Callable
from typing import Literal, NamedTuple

from .closed_forms import Array

Backend = Literal["numba", "python"]

VARIABLE = "AXISYNC_MOTION_BACKEND"
"""Environment: `numba` (an error if it cannot be used), `python`, or `auto`, the default: numba if it can be used."""

_log = logging.getLogger(__name__)


class Kernels(NamedTuple):
    """The compiled functions, by the names that they have in closed_forms.py, bound_loops.py and rate_loops.py."""

    plan_move: Callable[[Array, int, float, bool, Array, Array], float]
    plan_batch: Callable[[Array, Array, int, Array, bool, Array, Array, Array, Array], bool]
    cell_bounds: Callable[[Array, Array, Array, Array, Array], None]
    rate_slopes: Callable[[Array, Array, Array, float, Array, Array, Array, Array, Array], None]


class _Choice:
    name: Backend | None = None
    kernels: Kernels | None = None


def backend() -> Backend:
    """The backend in use; chooses it if nothing has yet.

    Raises as use_backend, for what the environment variable AXISYNC_MOTION_BACKEND says.
    """
    return _Choice.name or use_backend(os.environ.get(VARIABLE) or "auto")


def use_backend(name: str) -> Backend:
    """Choose: "numba", "python", or "auto", which is numba if it can be used. Returns what is used from now on.

    Choosing numba imports it, and compiles unless its cache has what is needed: seconds, once in an installation.
    Raises RuntimeError if "numba" cannot be used, ValueError for another name.
    """
    if name not in ("auto", "numba", "python"):
        raise ValueError(f"backend = {name!r}: must be 'auto', 'numba' or 'python'")
    _Choice.kernels = None if name == "python" else _load(required=name == "numba")
    _Choice.name = "python" if _Choice.kernels is None else "numba"
    return _Choice.name


def kernels() -> Kernels | None:
    """The compiled functions, or None where Python plans."""
    if _Choice.name is None:
        backend()
    return _Choice.kernels


def _load(*, required: bool) -> Kernels | None:
    # Anything may go wrong: no numba, one that is too old for this numpy, no directory for its cache. Python will do.
    try:
        from .compiled import KERNELS
    except Exception as error:
        reason = f"{type(error).__name__}: {str(error).partition(chr(10))[0]}"  # numba writes pages
        if required:
            raise RuntimeError(f"numba cannot be used: {reason}") from error
        if not isinstance(error, ModuleNotFoundError):
            _log.warning("backend=python reason=%r", reason)
        return None
    return KERNELS
