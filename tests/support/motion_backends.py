"""The planner's backends, for tests that each must pass."""

from collections.abc import Iterator

import pytest

from axisync_motion import use_backend


def _usable() -> bool:
    try:
        use_backend("numba")
    except RuntimeError:
        return False
    finally:
        use_backend("auto")
    return True


@pytest.fixture(scope="module", params=["python", "numba"])
def each_backend(request: pytest.FixtureRequest) -> Iterator[str]:
    """A module with `pytestmark = pytest.mark.usefixtures("each_backend")` runs once with each."""
    if request.param == "numba" and not _usable():
        pytest.skip("numba, the extra `fast`, is not installed")
    yield use_backend(request.param)
    use_backend("auto")
