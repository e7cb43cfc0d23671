"""What may be done now, row by row."""

from dataclasses import replace

import pytest

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import GroupState, Phase
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_service.actioner import admission
from axisync_service.actioner.world import GroupView, World

VIEW = GroupView(GroupState.STANDSTILL, 0, 0.0, 0.0, -1, None)
WORLD = World(5 * 10**9, Phase.RUNNING, True, 9, (0.0,) * 12, (0.0,) * 12, (0.0,) * 12, (VIEW, VIEW), None)


def refusal(work: object, *arguments: object) -> Refusal:
    assert callable(work)
    with pytest.raises(Refusal) as caught:
        work(*arguments)
    return caught.value


@pytest.mark.parametrize(
    ("state", "code"),
    [
        (GroupState.DISABLED, ErrorCode.NOT_ENABLED),
        (GroupState.MOVING, ErrorCode.BUSY),
        (GroupState.HELD, ErrorCode.WRONG_STATE),
        (GroupState.STOPPING, ErrorCode.BUSY),
        (GroupState.HOMING, ErrorCode.BUSY),
        (GroupState.JOGGING, ErrorCode.BUSY),
        (GroupState.FAULT, ErrorCode.FAULTED),
    ],
)
def test_states_that_cannot_begin_a_move(eod: Cell, state: GroupState, code: ErrorCode) -> None:
    world = replace(WORLD, groups=(VIEW, replace(VIEW, state=state, reason="axis 3 burnt")))
    admission.check_movable(eod, (0,), world)
    found = refusal(admission.check_movable, eod, (0, 1), world)
    assert found.code is code
    assert found.details["group"] == "wukong"
    assert found.details["state"] == state.label
    assert ("axis 3 burnt" in found.message) == (state is GroupState.FAULT)


def test_standstill_can_and_every_other_state_has_a_row() -> None:
    assert set(admission.NOT_MOVABLE) == set(GroupState) - {GroupState.STANDSTILL}


@pytest.mark.parametrize("state", list(GroupState))
def test_only_what_moves_cannot_be_planned_for(eod: Cell, state: GroupState) -> None:
    world = replace(WORLD, groups=(replace(VIEW, state=state), VIEW))
    if state in admission.NOT_AT_REST:
        assert refusal(admission.check_at_rest, eod, (0,), world).code is ErrorCode.BUSY
    else:
        admission.check_at_rest(eod, (0,), world)


def test_stale_says_by_how_much() -> None:
    admission.check_time(None, 10**18)
    admission.check_time(5.0, 5 * 10**9)
    found = refusal(admission.check_time, 4.0, 5 * 10**9)
    assert found.code is ErrorCode.STALE
    assert found.details == {"not_after_s": 4.0, "now_s": 5.0}


@pytest.mark.parametrize("phase", [Phase.STOPPING, Phase.CLOSING])
def test_nothing_begins_while_the_service_stops(phase: Phase) -> None:
    admission.check_running(Phase.RUNNING)
    assert refusal(admission.check_running, phase).code is ErrorCode.UNAVAILABLE


@pytest.mark.parametrize("change", [{"up": False}, {"tick": 0}])
def test_nothing_begins_without_a_cycle(change: dict[str, object]) -> None:
    admission.check_controller(WORLD)
    assert refusal(admission.check_controller, replace(WORLD, **change)).code is ErrorCode.UNAVAILABLE
