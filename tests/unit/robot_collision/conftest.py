"""The shipped cell and its collision model, made once."""

import pytest

from axisync_robot.collision import CollisionModel
from axisync_schemas.cell import Cell, parse_cell
from support.cells import eod_text
from support.motion_backends import each_backend

__all__ = ["each_backend"]


@pytest.fixture(scope="session")
def cell_text() -> str:
    return eod_text()


@pytest.fixture(scope="session")
def cell(cell_text: str) -> Cell:
    return parse_cell(cell_text)


@pytest.fixture(scope="session")
def model(cell: Cell) -> CollisionModel:
    return CollisionModel(cell)
