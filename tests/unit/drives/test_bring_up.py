"""Bring-up against a drive's objects: what is written, what is refused and in which words, and how it recovers."""

import struct

import pytest

from axisync_schemas.cell import Cell, parse_cell
from axisync_schemas.enumerations import NmtState
from axisync_service.canopen.nmt import NmtCommand
from axisync_service.canopen.sdo import ABORT_WORDS
from axisync_service.drives.bring_up import RETRY_NS, BringUp, Phase
from axisync_service.drives.configuration import rows
from support.cells import eod_text
from support.sdo_server import SdoServer, run

TEXT = eod_text()
CELL = parse_cell(TEXT)


def begin(cell: Cell = CELL, axis: int = 1) -> tuple[BringUp, SdoServer]:
    return BringUp(cell, cell.axes[axis]), SdoServer(cell.axes[axis])


def value(server: SdoServer, index: int, sub: int = 0, signed: bool = False) -> int:
    return int.from_bytes(server.values[index, sub], "little", signed=signed)


def test_everything_that_a_drive_must_know_is_written_and_read_back() -> None:
    bring_up, server = begin()
    run(bring_up, server)
    assert bring_up.ready, bring_up.failure
    assert bring_up.serial == 77
    for index, sub, expected in (
        (0x1006, 0, 2000), (0x1007, 0, 1800), (0x1016, 1, 127 << 16 | 60), (0x1017, 0, 100), (0x1019, 0, 240),
        (0x1029, 1, 1), (0x1400, 1, 0x202), (0x1400, 2, 1), (0x1400, 5, 18), (0x1600, 1, 0x60400010),
        (0x1600, 2, 0x607A0020), (0x1800, 1, 0x182), (0x1800, 2, 1), (0x1A00, 2, 0x60640020), (0x1801, 1, 0x282),
        (0x1801, 2, 8), (0x1A01, 1, 0x606C0020), (0x1A01, 2, 0x60770010), (0x6060, 0, 8), (0x60C2, 1, 2),
        (0x6065, 0, 5825), (0x6066, 0, 20), (0x607D, 2, 524288), (0x6007, 0, 3), (0x605A, 0, 2), (0x605B, 0, 1),
        (0x605C, 0, 1), (0x605D, 0, 1), (0x605E, 0, 2), (0x6084, 0, 262144), (0x6085, 0, 262144),
    ):  # fmt: skip
        assert value(server, index, sub) == expected, hex(index)
    assert value(server, 0x60C2, 2, signed=True) == -3
    assert value(server, 0x607D, 1, signed=True) == round(-210 / 360 * 2**20)
    for row in rows(CELL, CELL.axes[1]):
        assert (row.index, row.sub) in server.written
        absent = (row.index, row.sub) not in server.values
        assert absent or not row.verify or (row.index, row.sub) in server.read


def test_second_tpdos_of_a_bus_take_turns() -> None:
    starts = []
    for axis in range(6):
        bring_up, server = begin(axis=axis)
        run(bring_up, server)
        starts.append(value(server, 0x1801, 6))
    assert len({start % 8 for start in starts}) == 6
    assert all(1 <= start <= 8 for start in starts)


def test_a_full_bus_has_no_second_tpdo() -> None:
    cell = parse_cell(TEXT.replace("period_ms = 2.0", "period_ms = 1.8"))
    bring_up, server = begin(cell)
    run(bring_up, server)
    assert bring_up.ready, bring_up.failure
    assert value(server, 0x1801, 1) == 0x80000282


def test_limits_of_torque_and_units_are_the_cell_files() -> None:
    text = TEXT.replace(
        "brake_release_ms = 60",
        "brake_release_ms = 60\ntorque_max_percent = 80\nunits = { acceleration_counts_s2 = 10.0 }",
        1,
    )
    bring_up, server = begin(parse_cell(text))
    run(bring_up, server)
    assert value(server, 0x6072) == 800
    assert value(server, 0x6085) == 26214


def test_a_range_beyond_the_counter_leaves_the_drives_limits_open() -> None:
    """Positions wrap then, so no pair of INT32 numbers can bound them."""
    text = TEXT.replace("gear_ratio = 1.0", "gear_ratio = 5000.0", 1).replace('on_missed = "extrapolate"\n', "", 1)
    bring_up, server = begin(parse_cell(text))
    run(bring_up, server)
    assert value(server, 0x607D, 1, signed=True) == -(2**31)
    assert value(server, 0x607D, 2) == 2**31 - 1


def test_objects_of_the_emulated_drive_are_not_written_to_others() -> None:
    text = TEXT.replace("vendor_id = 0x41584953", "vendor_id = 0x6A")
    bring_up, server = begin(parse_cell(text))
    run(bring_up, server)
    assert bring_up.ready, bring_up.failure
    assert (0x2000, 0) not in server.written


def test_a_drive_may_keep_the_bit_that_forbids_remote_requests() -> None:
    bring_up, server = begin()
    take = server.answer

    def stubborn(frame: bytes) -> bytes | None:
        answer = take(frame)
        if (0x1800, 1) in server.values:
            server.values[0x1800, 1] = struct.pack("<I", value(server, 0x1800, 1) | 1 << 30)
        return answer

    server.answer = stubborn  # type: ignore[method-assign]
    run(bring_up, server)
    assert bring_up.ready, bring_up.failure


# --- what is refused ----------------------------------------------------------------------------------------------


def transfers() -> list[tuple[int, int, bool]]:
    """Every transfer of a bring-up."""
    bring_up, server = begin()
    seen: list[tuple[int, int, bool]] = []
    server.abort = lambda index, sub, writes: seen.append((index, sub, writes))  # type: ignore[assignment,func-returns-value]
    run(bring_up, server)
    assert bring_up.ready
    return seen


@pytest.mark.parametrize("code", [0x05040000, 0x06010002, 0x06040041, 0x06070010, 0x06090030, 0x08000022, 0x12345678])
def test_an_abort_at_any_step_is_said_with_bus_node_object_and_words(code: int) -> None:
    forgiven = {0x1003, 0x6502}
    for number, (index, sub, writes) in enumerate(transfers()):
        bring_up, server = begin()
        count = iter(range(1000))
        server.abort = lambda *_, at=number, count=count: code if next(count) == at else None  # type: ignore[misc]
        now = run(bring_up, server)
        if index in forgiven:
            assert bring_up.ready, f"{index:#x}"
            continue
        failure = bring_up.failure or ""
        assert "(bus kingkong, node 2)" in failure, f"{index:#x}:{sub} {writes}"
        assert f"0x{index:04X}:{sub}" in failure
        assert f"abort 0x{code:08X}: {ABORT_WORDS.get(code, 'unknown abort code')}" in failure
        assert bring_up.phase is Phase.FAILED
        bring_up.step(now + RETRY_NS + 1)
        run_again(bring_up, server, now + RETRY_NS)


def run_again(bring_up: BringUp, server: SdoServer, from_ns: int) -> None:
    """The failure stands until a new attempt has led somewhere."""
    now = from_ns
    for _ in range(400):
        now += 2_000_000
        bring_up.step(now)
        server.serve(bring_up, now)
        if bring_up.ready:
            break
        assert bring_up.failure is not None
    assert bring_up.ready
    assert bring_up.failure is None


@pytest.mark.parametrize("code", [0x06020000, 0x06090011])
def test_objects_that_a_drive_need_not_have_may_be_missing(code: int) -> None:
    optional = {(row.index, row.sub) for row in rows(CELL, CELL.axes[1]) if row.optional}
    bring_up, server = begin()
    server.abort = lambda index, sub, writes: code if (index, sub) in optional or index in (0x6502, 0x1003) else None
    run(bring_up, server)
    assert bring_up.ready, bring_up.failure
    bring_up, server = begin()
    server.abort = lambda index, sub, writes: code if (index, sub) == (0x6085, 0) else None
    run(bring_up, server)
    assert "0x6085:0 (Quick stop deceleration)" in (bring_up.failure or "")


def test_what_reads_back_differently_is_refused() -> None:
    bring_up, server = begin()
    take = server.answer

    def clamps(frame: bytes) -> bytes | None:
        answer = take(frame)
        server.values[0x6085, 0] = struct.pack("<I", 1000)
        return answer

    server.answer = clamps  # type: ignore[method-assign]
    run(bring_up, server)
    assert (bring_up.failure or "").endswith("0x6085:0 (Quick stop deceleration) reads back 1000, not 262144")


@pytest.mark.parametrize(("sub", "what"), [(1, "vendor_id"), (2, "product_code")])
def test_a_foreign_drive_stays_pre_operational_until_the_right_one_is_back(sub: int, what: str) -> None:
    bring_up, server = begin()
    right, server.values[0x1018, sub] = server.values[0x1018, sub], struct.pack("<I", 0xBAD)
    now = run(bring_up, server)
    assert f"{what} is 0x00000BAD" in (bring_up.failure or "")
    assert bring_up.foreign
    assert not server.written
    server.values[0x1018, sub] = right
    run_again(bring_up, server, now + RETRY_NS)


def test_the_serial_number_counts_where_the_cell_file_names_it() -> None:
    text = TEXT.replace("product_code = 0x00000001 }", "product_code = 0x00000001, serial_number = 78 }")
    bring_up, server = begin(parse_cell(text))
    run(bring_up, server)
    assert "serial_number is 0x0000004D" in (bring_up.failure or "")


def test_a_drive_without_csp_is_refused() -> None:
    bring_up, server = begin()
    server.values[0x6502, 0] = struct.pack("<I", 0x21)
    run(bring_up, server)
    assert "cyclic synchronous position" in (bring_up.failure or "")


def test_an_absent_drive_is_asked_again_and_again() -> None:
    bring_up, server = begin()
    server.silent = True
    now = run(bring_up, server)
    assert "does not answer" in (bring_up.failure or "")
    assert "SDO protocol timed out" in (bring_up.failure or "")
    server.silent = False
    run_again(bring_up, server, now + RETRY_NS)


def test_a_stopped_node_is_led_to_where_it_can_answer() -> None:
    bring_up, server = begin()
    server.silent = True
    run(bring_up, server)
    bring_up.nmt = NmtState.STOPPED
    bring_up.retry()
    assert bring_up.command is NmtCommand.ENTER_PRE_OPERATIONAL


def test_a_node_that_does_not_start_is_said() -> None:
    bring_up, server = begin()
    now = 0
    for _ in range(1000):
        now += 2_000_000
        bring_up.step(now)
        server.serve(bring_up, now)
        bring_up.nmt = NmtState.PRE_OPERATIONAL
        if bring_up.failure:
            break
    assert "does not become operational, its heartbeat says pre_operational" in (bring_up.failure or "")
