"""The status that front reads: gathered drive by drive, and whole wherever something has happened."""

import pytest

from axisync_schemas.cell import parse_cell
from axisync_schemas.internal import CONTROLLER_STATUS, ControllerStatus
from axisync_schemas.memory import STATUS_BYTES, Mailbox
from axisync_service.motion_controller.status import StatusWriter
from axisync_service.motion_controller.step import Core
from support.cells import eod_text

TEXT = eod_text()
INTERVAL = 25


class Rig:
    """Drives whose statuswords tell the tick in which they were looked at."""

    def __init__(self, interval: int = INTERVAL) -> None:
        self.core = Core(parse_cell(TEXT), lambda slot, plan_id: pytest.fail(f"no plan {plan_id} in {slot}"))
        self.mailbox = Mailbox(bytearray(STATUS_BYTES))
        self.writer = StatusWriter(self.mailbox, self.core.drives, interval)

    def at(self, tick: int) -> None:
        for drive in self.core.drives:
            drive.statusword = tick

    def write(self, tick: int) -> ControllerStatus:
        self.at(tick)
        self.writer.write(self.core, [], [], tick, 0, 0)
        data = self.mailbox.read()
        assert data is not None
        return CONTROLLER_STATUS.validate_json(data)


def looked_at(status: ControllerStatus) -> list[int]:
    return [drive.statusword for drive in status.drives]


def test_the_first_status_is_whole() -> None:
    status = Rig().write(7)
    assert looked_at(status) == [7] * 12
    assert (status.tick, len(status.groups), status.buses) == (7, 2, ())


@pytest.mark.parametrize("interval", [4, 5, INTERVAL])
def test_every_drive_is_looked_at_between_two(interval: int) -> None:
    rig = Rig(interval)
    rig.write(0)
    for tick in range(1, interval):
        rig.at(tick)
        rig.writer.look()
    seen = looked_at(rig.write(interval))
    assert min(seen) >= 1
    assert seen == sorted(seen)
    assert max(seen.count(tick) for tick in seen) == 3


def test_drives_whose_turn_did_not_come_are_looked_at_last() -> None:
    """Skipped ticks look at nothing."""
    rig = Rig()
    rig.write(0)
    rig.at(1)
    rig.writer.look()
    assert looked_at(rig.write(25)) == [1] * 3 + [25] * 9


def test_after_an_event_it_is_whole() -> None:
    rig = Rig()
    rig.write(0)
    for tick in range(1, 9):
        rig.at(tick)
        rig.writer.look()
    rig.writer.renew()
    assert looked_at(rig.write(9)) == [9] * 12


def test_a_home_that_was_lost_is_told_with_its_count() -> None:
    """The supervisor keeps homes by the count; the drives beside it must be those of the count."""
    rig = Rig()
    rig.write(0)
    for tick in range(1, 9):
        rig.at(tick)
        rig.writer.look()
    rig.core.watch.homes_lost += 1
    status = rig.write(9)
    assert (status.homed_changes, looked_at(status)) == (1, [9] * 12)


def test_a_reason_cannot_be_taken_for_the_place_of_the_drives() -> None:
    rig = Rig()
    rig.core.groups[0].reason = 'a "drives":[] in a text'
    status = rig.write(3)
    assert status.groups[0].reason == 'a "drives":[] in a text'
    assert looked_at(status) == [3] * 12
