"""Stop: counters grow, whatever the body's fate; the answer says in which states the groups are."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.enumerations import GroupState, Phase
from axisync_schemas.memory import Control, GroupWord
from axisync_service.actioner.world import GroupView, World
from axisync_service.hmi.stop import StopHandler

CELL_FILE = Path(__file__).parents[3] / "service" / "axisync_service" / "cells" / "eod.toml"
VIEW = GroupView(GroupState.STOPPING, 1, 0.5, 0.5, 0, None)
WORLD = World(0, Phase.RUNNING, True, 1, (), (), (), (VIEW, replace(VIEW, state=GroupState.STANDSTILL)), None)


class Rig:
    """A stop handler on a plain buffer."""

    def __init__(self, cell: Cell) -> None:
        self.control = Control(bytearray(Control.size(2)), 2)
        self.world = WORLD
        self.handler = StopHandler(cell, self.control, lambda: self.world)

    def counts(self) -> list[int]:
        return [self.control.group(i, GroupWord.STOP_COUNT) for i in (0, 1)]

    def stop(self, body: bytes) -> tuple[bool, dict[str, Any]]:
        answer = self.handler(body)
        return answer.is_error, json.loads(answer.payload)


@pytest.fixture
def rig() -> Rig:
    return Rig(read_cell(CELL_FILE)[0])


@pytest.mark.parametrize(
    ("body", "counts"),
    [
        (b"", [1, 1]),
        (b"{}", [1, 1]),
        (b'{"group": "all"}', [1, 1]),
        (b'{"group": "both"}', [1, 1]),
        (b'{"group": "wukong"}', [0, 1]),
        (b'{"group": "kingkong", "not_after_s": 0.0}', [1, 0]),
    ],
)
def test_counters_grow(rig: Rig, body: bytes, counts: list[int]) -> None:
    is_error, reply = rig.stop(body)
    assert not is_error
    assert rig.counts() == counts
    states = {"kingkong": "stopping", "wukong": "standstill"}
    assert reply["groups"] == {name: states[name] for name, count in zip(states, counts, strict=True) if count}


def test_every_stop_counts(rig: Rig) -> None:
    body = b'{"request_id": "00000000-0000-4000-8000-000000000001"}'
    for _ in range(3):
        assert rig.stop(body)[1]["request_id"] == "00000000-0000-4000-8000-000000000001"
    assert rig.counts() == [3, 3]


@pytest.mark.parametrize(
    ("body", "code"),
    [
        (b"{", "INVALID_REQUEST"),
        (b"\xff", "INVALID_REQUEST"),
        (b'{"group": "nobody"}', "INVALID_REQUEST"),
        (b'{"group": "kingkong", "hard": true}', "INVALID_REQUEST"),
        (b'{"schema": 2}', "UNSUPPORTED_SCHEMA"),
    ],
)
def test_what_is_no_stop(rig: Rig, body: bytes, code: str) -> None:
    is_error, reply = rig.stop(body)
    assert is_error
    assert reply["code"] == code
    assert rig.counts() == [0, 0]


def test_without_a_controller_it_says_so_and_counts_all_the_same(rig: Rig) -> None:
    rig.world = replace(WORLD, up=False)
    is_error, reply = rig.stop(b"{}")
    assert is_error
    assert reply["code"] == "UNAVAILABLE"
    assert rig.counts() == [1, 1]
