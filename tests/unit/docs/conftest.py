"""Programs of docs/ are run by path, not installed: here they are loaded by path."""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).parents[3] / "docs"


def loaded(name: str, needs: tuple[str, ...]) -> Iterator[ModuleType]:
    """A script with its neighbours. Skips without what it draws with and compares with."""
    for package in needs:
        pytest.importorskip(package)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(DOCS)
        spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        patch.setitem(sys.modules, spec.name, module)
        spec.loader.exec_module(module)
        yield module


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    yield from loaded("draw_figures", ("matplotlib", "ruckig"))


@pytest.fixture(scope="module")
def arms() -> Iterator[ModuleType]:
    yield from loaded("draw_arms", ("matplotlib", "ruckig", "toppra"))
