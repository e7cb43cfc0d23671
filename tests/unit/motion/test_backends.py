"""The choice of a backend, and that what only follows trajectories never pays for it."""

import os
import subprocess
import sys

import pytest

from axisync_motion import backend, use_backend

PLAN = "import sys, axisync_motion as m; m.synchronise([1.0], [1.0], [1.0], [1.0])"


def run(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    names = {key: value for key, value in os.environ.items() if key != "AXISYNC_MOTION_BACKEND"}
    command = [sys.executable, "-W", "error", "-c", code]
    return subprocess.run(command, env=names | environment, capture_output=True, text=True, timeout=60)


def printed(code: str, **environment: str) -> str:
    done = run(code, **environment)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_processes_in_the_cycle_import_no_compiler() -> None:
    modules = "axisync_motion, axisync_motion.trajectory, axisync_service.controller, axisync_service.front"
    evaluate = "axisync_motion.Evaluator(axisync_motion.concatenate([t])).at(0.5)"
    trajectory = "t = axisync_motion.Trajectory(n.array([0.0, 1.0]), n.ones((1, 4, 2)), n.ones(2), n.full(2, 4.0))"
    code = f"import sys, numpy as n, {modules}; {trajectory}; {evaluate}; print('numba' in sys.modules)"
    assert printed(code) == "False"


def test_environment_says_python() -> None:
    code = f"{PLAN}; print(m.backend(), 'numba' in sys.modules)"
    assert printed(code, AXISYNC_MOTION_BACKEND="python") == "python False"


def test_environment_says_numba() -> None:
    pytest.importorskip("numba")
    assert printed(f"{PLAN}; print(m.backend())", AXISYNC_MOTION_BACKEND="numba") == "numba"
    assert printed(f"{PLAN}; print(m.backend())") == "numba"


def test_environment_says_nonsense() -> None:
    assert "backend = 'fortran': must be" in run(PLAN, AXISYNC_MOTION_BACKEND="fortran").stderr


def test_without_numba() -> None:
    missing = "import sys; sys.modules['numba'] = None"
    assert printed(f"{missing}; {PLAN}; print(m.backend())") == "python"
    assert "numba cannot be used" in run(f"{missing}; {PLAN}", AXISYNC_MOTION_BACKEND="numba").stderr


@pytest.mark.parametrize(
    ("before", "environment"),
    [
        ("from numba.core.caching import CacheImpl; CacheImpl._locator_classes = []", {}),  # nowhere to write its cache
        ("pass", {"NUMBA_DISABLE_JIT": "1"}),
    ],
)
def test_numba_that_cannot_work_is_not_used_and_said_so(before: str, environment: dict[str, str]) -> None:
    pytest.importorskip("numba")
    done = run(f"{before}; {PLAN}; print(m.backend())", **environment)
    assert done.stdout.strip() == "python", done.stderr
    assert done.stderr.count("\n") == 1
    assert "backend=python reason=" in done.stderr


def test_choice_can_be_changed() -> None:
    assert use_backend("python") == backend() == "python"
    assert use_backend("auto") == backend()
    with pytest.raises(ValueError, match="backend = 'fortran'"):
        use_backend("fortran")
