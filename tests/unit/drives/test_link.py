"""One drive by its frames: positions that wrap, jump or stand still, TPDO2, and when a home is lost."""

import struct

import pytest

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.enumerations import NmtState
from axisync_service.canopen.pdo import make_rpdo1
from axisync_service.drives.bring_up import RETRY_NS, Phase
from axisync_service.drives.link import DriveLink
from support.cells import eod_text
from support.sdo_server import SdoServer, run

TEXT = eod_text()
ENABLED = 0x1237
HOMING = "homing = { method = 37 }, "


def cell_with(keys: str = "") -> Cell:
    return parse_cell(TEXT.replace("drive = { node_id = 1,", f"drive = {{ {keys}node_id = 1,", 1))


def link(keys: str = "") -> DriveLink:
    cell = cell_with(keys)
    made = DriveLink(cell, cell.axes[0])
    made.bring_up.phase = Phase.READY
    made.bring_up.nmt = NmtState.OPERATIONAL
    return made


def sample(drive: DriveLink, counts: int, now_ns: int = 0) -> None:
    """One executed tick with a TPDO1."""
    raw = (counts + 2**31) % 2**32 - 2**31
    drive.on_tpdo1(make_rpdo1(ENABLED, raw))
    drive.on_heartbeat(b"\x05", now_ns)
    drive.end_of_read(now_ns)


def test_positions_go_on_where_the_counter_wraps() -> None:
    drive = link()
    sample(drive, 2**31 - 5)
    sample(drive, 2**31 + 5)
    assert drive.actual == 2**31 + 5
    assert drive.distrust() is None
    sample(drive, 2**31 - 5)
    assert drive.actual == 2**31 - 5


def test_the_first_position_is_the_one_within_the_axis_limits() -> None:
    drive = link("offset_deg = -737280, ")  # 0 deg is at count 2^31: half of the axis's range is beyond the counter's.
    sample(drive, 2**31 + 1000)
    assert drive.actual == 2**31 + 1000
    again = link("offset_deg = -737280, ")
    sample(again, 2**31 - 1000)
    assert again.actual == 2**31 - 1000


def test_a_step_that_no_axis_can_make_is_not_believed() -> None:
    drive = link()
    sample(drive, 0)
    sample(drive, 500)  # 30 deg/s * 1.5 * 2 cycles = 524 counts
    assert drive.distrust() is None
    sample(drive, 1100)
    assert drive.distrust() == "its position jumped by 600 counts within one cycle"
    sample(drive, 1100)
    assert drive.distrust() is None


def test_after_a_missed_sample_a_step_may_be_longer() -> None:
    drive = link()
    sample(drive, 0)
    drive.end_of_read(0)
    assert drive.missed == 1
    sample(drive, 1000)
    assert drive.distrust() is None


def test_equal_samples_are_counted_missing_ones_are_not() -> None:
    drive = link()
    for _ in range(4):
        sample(drive, 7)
    assert drive.same == 3
    drive.end_of_read(0)
    assert drive.same == 0


def test_velocity_and_torque() -> None:
    drive = link("direction = -1, units = { speed_counts_s = 10.0 }, ")
    drive.on_tpdo2(struct.pack("<ih", 104858, -125))
    assert drive.velocity == pytest.approx(-6.2831853, rel=1e-4)
    assert drive.torque == -0.125
    drive.on_tpdo2(b"short")
    assert drive.torque == -0.125
    drive.lose()
    assert drive.velocity is None


# --- homed or not -------------------------------------------------------------------------------------------------


def restarted(keys: str, nmt: NmtState, serial: int = 77) -> tuple[DriveLink, str | None]:
    """A drive that an earlier run homed, found in NMT state `nmt` and brought up; and why its home was lost."""
    cell = cell_with(keys)
    drive = DriveLink(cell, cell.axes[0])
    drive.adopt_home(77)
    server = SdoServer(cell.axes[0], serial)
    lost, now = None, 0
    for _ in range(400):
        now += 2_000_000
        if now == 40_000_000 and nmt is not NmtState.UNKNOWN:
            drive.on_heartbeat(bytes((nmt,)), now)
        drive.bring_up.step(now)
        lost = drive.home_lost() or lost
        server.serve(drive.bring_up, now)
    assert drive.bring_up.ready
    return drive, lost


@pytest.mark.parametrize(
    ("encoder", "nmt", "homed"),
    [
        ("absolute", NmtState.UNKNOWN, True),
        ("absolute", NmtState.PRE_OPERATIONAL, True),
        ("incremental", NmtState.OPERATIONAL, True),
        ("incremental", NmtState.PRE_OPERATIONAL, False),
        ("incremental", NmtState.UNKNOWN, False),
    ],
)
def test_a_restart_keeps_the_home_where_the_drive_kept_its_power(encoder: str, nmt: NmtState, homed: bool) -> None:
    drive, lost = restarted(f'encoder = "{encoder}", {HOMING}', nmt)
    assert drive.homed is homed
    assert drive.needs_homing is not homed
    assert lost == (None if homed else "its incremental encoder has lost power")


def test_another_drive_has_another_home() -> None:
    drive, lost = restarted(HOMING, NmtState.UNKNOWN, serial=78)
    assert not drive.homed
    assert lost == "the drive's serial number is 78, it was homed with 77"


def test_a_boot_up_clears_the_home_of_an_incremental_encoder_only() -> None:
    for encoder, homed in (("absolute", True), ("incremental", False)):
        keys = f'encoder = "{encoder}", {HOMING}'
        drive, server = link(keys), SdoServer(cell_with(keys).axes[0])
        drive.homed, drive.homed_serial = True, 77
        drive.on_heartbeat(b"\0", 0)
        drive.bring_up.nmt = NmtState.PRE_OPERATIONAL
        for tick in range(200):
            drive.bring_up.step(tick * 2_000_000)
            drive.home_lost()
            server.serve(drive.bring_up, tick * 2_000_000)
        assert drive.bring_up.ready
        assert drive.homed is homed


def test_a_foreign_identity_clears_the_home() -> None:
    drive = link(HOMING)
    drive.homed, drive.homed_serial = True, 77
    drive.lose()
    server = SdoServer(drive.axis)
    server.values[0x1018, 2] = b"\x09\0\0\0"
    now = run(drive.bring_up, server)
    assert drive.home_lost() == "another drive answers"
    server.values[0x1018, 2] = b"\x01\0\0\0"
    for tick in range(200):
        drive.bring_up.step(now + RETRY_NS + tick * 2_000_000)
        server.serve(drive.bring_up, now + RETRY_NS + tick * 2_000_000)
    assert drive.bring_up.ready
    assert drive.needs_homing


def test_an_axis_without_homing_never_needs_any() -> None:
    assert not link().needs_homing
