"""Each fault of buses and drives once, with two axes an arm; `make campaign` has twelve axes and many seeds."""

from pathlib import Path

import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.enumerations import GroupState
from axisync_schemas.errors import ErrorCode
from axisync_schemas.internal import ControllerReply, GroupCommand
from support.bus_faults import (
    FOREIGN,
    LATCHED,
    TOLERATED,
    Setup,
    goes_on,
    play_with,
    stops_and_latches,
    stops_on_its_path,
    wrapping,
)
from support.cells import eod_text, small
from support.lock_step import Script, Steps, conduct, emulated

SEED = 1
FOUR = Setup(small(eod_text()), range(260, 320))
LONG = Setup(wrapping(FOUR.text), range(260, 260 + 50 * len(TOLERATED)))
TICKS_UP = 450

SPOILT = {
    "wrong_vendor": ({"kind": "identity", "vendor_id": 7}, "vendor_id is 0x00000007"),
    "SDO_abort": ({"kind": "sdo", "index": 0x6085, "abort": 0x06090030}, "invalid value for parameter"),
    "no_answer": ({"kind": "sdo", "index": 0x60C2, "sub": 1}, "SDO protocol timed out"),
    "two_nodes_with_one_id": ({"kind": "twin"}, "two nodes answer under this node id"),
}
"""From power-on: the fault, and what is said of it."""


def test_what_is_tolerated_one_after_the_other_while_counts_wrap(tmp_path: Path) -> None:
    goes_on(play_with(tmp_path, LONG, list(TOLERATED.values()), SEED))


@pytest.mark.parametrize("name", LATCHED)
def test_stops_the_group_and_nobody_else_jerks(tmp_path: Path, name: str) -> None:
    stops_and_latches(play_with(tmp_path, FOUR, [LATCHED[name].make], SEED), LATCHED[name])


@pytest.mark.parametrize("name", FOREIGN)
def test_frames_of_others_stop_the_arms_on_their_path(tmp_path: Path, name: str) -> None:
    stops_on_its_path(play_with(tmp_path, FOUR, [FOREIGN[name].make], SEED), FOREIGN[name])


@pytest.mark.parametrize("name", SPOILT)
def test_a_drive_that_cannot_be_brought_up_stays_pre_operational(tmp_path: Path, name: str) -> None:
    fault, words = SPOILT[name]
    replies: list[ControllerReply | None] = []

    def steps() -> Steps:
        for _ in range(TICKS_UP):
            yield None
        replies.append((yield GroupCommand(op="enable", ref=0, group="kingkong")))
        replies.append((yield GroupCommand(op="enable", ref=0, group="wukong")))

    (tmp_path / "cell.toml").write_text(FOUR.text, encoding="utf-8")
    with emulated(tmp_path / "cell.toml", tmp_path, [{"bus": "kingkong", "node": 2, "at_s": 0.0, **fault}]):
        done = conduct(parse_cell(FOUR.text).on_simcan(str(tmp_path)), Script(steps()), [])
    refused, accepted = replies
    assert refused is not None
    assert refused.error is not None
    assert refused.error.code is ErrorCode.UNAVAILABLE
    assert words in refused.error.message
    assert "kingkong.2 (bus kingkong, node 2)" in refused.error.message
    assert accepted is not None
    assert accepted.error is None
    assert set(done.records["group_state"][:, 0]) == {GroupState.DISABLED}
    heartbeats = [line for line in (tmp_path / "frames.log").read_text().splitlines() if " kingkong 702#" in line]
    assert not any(line.endswith("#05") for line in heartbeats)
