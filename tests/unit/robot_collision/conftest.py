"""The shipped cell and its collision model, made once."""

from importlib import resources

import pytest

from axisync_robot.collision import CollisionModel
from axisync_schemas.cell import Cell, parse_cell
from support.motion_backends import each_backend

__all__ = ["each_backend"]


@pytest.fixture(scope="session")
def cell_text() -> str:
    return resources.files("axisync_service").joinpath("cells/eod.toml").read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def cell(cell_text: str) -> Cell:
    return parse_cell(cell_text)


@pytest.fixture(scope="session")
def model(cell: Cell) -> CollisionModel:
    return CollisionModel(cell)
