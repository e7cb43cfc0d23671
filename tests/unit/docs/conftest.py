"""Programs of docs/ are run by path, not installed: here they are loaded by path."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).parents[3] / "docs"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """draw_figures.py, with its neighbour. Skips without what it draws and compares with."""
    pytest.importorskip("matplotlib")
    pytest.importorskip("ruckig")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(DOCS)
        spec = importlib.util.spec_from_file_location("draw_figures", DOCS / "draw_figures.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        patch.setitem(sys.modules, spec.name, module)
        spec.loader.exec_module(module)
        return module
