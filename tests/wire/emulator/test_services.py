"""Byte-exact frames of the CANopen services: boot-up, heartbeat, NMT, SDO, EMCY history."""

import struct

import pytest

MS = 1_000_000


def test_boot_up_then_heartbeats_of_pre_operational(make_bench):
    bench = make_bench()
    bench.power_on()
    frames = bench.run(250 * MS)
    assert [(can_id, data) for _, can_id, data in frames] == [(0x701, b"\x00"), (0x701, b"\x7f"), (0x701, b"\x7f")]
    # 100 ms apart by default; 56 bits with their stuffing on the wire.
    assert frames[2][0] - frames[1][0] == 100 * MS


def test_drives_boot_in_the_order_of_their_identifiers(make_bench):
    bench = make_bench(drives=6)
    bench.power_on()
    assert [can_id for _, can_id, _ in bench.run(10 * MS)] == [0x701, 0x702, 0x703, 0x704, 0x705, 0x706]


@pytest.mark.parametrize(("command", "state"), [(0x01, 0x05), (0x02, 0x04), (0x80, 0x7F)])
@pytest.mark.parametrize("addressed", [0, 1])
def test_nmt_commands_show_in_the_heartbeat(bench, command: int, state: int, addressed: int):
    bench.send(0x000, bytes([command, addressed]))
    frames = bench.run(150 * MS)
    assert (0x701, bytes([state])) in [(can_id, data) for _, can_id, data in frames]


@pytest.mark.parametrize("data", [b"\x01\x02", b"\x01", b"\x33\x01", b"\x01\x01\x01"])
def test_nmt_frames_for_others_or_none_change_nothing(bench, data: bytes):
    bench.send(0x000, data)
    assert {data for _, can_id, data in bench.run(300 * MS) if can_id == 0x701} == {b"\x7f"}


@pytest.mark.parametrize("command", [0x81, 0x82])
def test_resets_boot_again_with_default_communication(bench, command: int):
    assert bench.write(0x1017, 0, 50, 2) == 0
    bench.start()
    bench.send(0x000, bytes([command, 1]))
    frames = bench.run(250 * MS)
    assert [data for _, can_id, data in frames if can_id == 0x701] == [b"\x00", b"\x7f", b"\x7f"]
    assert bench.read(0x1017) == 100
    # The profile's objects survive a reset of the communication only.
    assert bench.read(0x6060) == (0 if command == 0x81 else 8)


def test_no_sdo_while_stopped(bench):
    bench.send(0x000, b"\x02\x01")
    bench.run(2 * MS)
    bench.send(0x601, bytes.fromhex("4018100100000000"))
    assert [can_id for _, can_id, _ in bench.run(20 * MS)] == [0x601]


def test_sdo_expedited_upload_and_download(bench):
    assert bench.request(1, bytes.fromhex("4018100100000000")).hex() == "4318100153495841"
    assert bench.request(1, bytes.fromhex("4017100000000000")).hex() == "4b17100064000000"
    assert bench.request(1, bytes.fromhex("2b171000c8000000")).hex() == "6017100000000000"
    assert bench.request(1, bytes.fromhex("4017100000000000")).hex() == "4b171000c8000000"


def test_sdo_segmented_upload(bench):
    answer = bench.request(1, bytes.fromhex("4008100000000000"))
    size = struct.unpack_from("<I", answer, 4)[0]
    assert answer[:4] == bytes.fromhex("41081000")
    text, toggle = b"", 0
    while True:
        answer = bench.request(1, bytes([0x60 | toggle, *bytes(7)]))
        assert answer[0] & 0x10 == toggle
        text += answer[1 : 8 - (answer[0] >> 1 & 7)]
        toggle ^= 0x10
        if answer[0] & 1:
            break
    assert text == b"axisync emulated servo drive"
    assert size == len(text)


def test_sdo_segmented_download(bench):
    assert bench.request(1, bytes.fromhex("2185600004000000"))[0] == 0x60
    assert bench.request(1, bytes([0x07, *struct.pack("<I", 123456), 0, 0, 0]))[0] == 0x20
    assert bench.read(0x6085) == 123456


@pytest.mark.parametrize(
    ("request_frame", "code"),
    [
        ("4034120000000000", 0x06020000),  # no such object
        ("4018100900000000", 0x06090011),  # no such sub-index of a record
        ("4003100900000000", 0x06090011),  # nor of an array
        ("2341600012340000", 0x06010002),  # read-only
        ("2341600000000000", 0x06010002),
        ("2340600000000000", 0x06070010),  # four bytes into two
        ("2f6060000a000000", 0x06090030),  # no such mode
        ("2f19100001000000", 0x06090030),  # reserved overflow
        ("2f19100010000000", 0x08000022),  # 0x1019 while 0x1006 is not 0
        ("2310100100000000", 0x08000020),  # without the signature
        ("230f6000ffff0000", 0x06020000),
        ("2b5a600063000000", 0x06090030),  # no such option code
        ("e001020304050607", 0x05040001),  # no such command
    ],
)
def test_sdo_aborts(bench, request_frame: str, code: int):
    answer = bench.request(1, bytes.fromhex(request_frame))
    assert answer[0] == 0x80
    assert struct.unpack_from("<I", answer, 4)[0] == code


@pytest.mark.parametrize("first", [0x60, 0x00, 0x70])
def test_a_segment_before_any_transfer_is_aborted(make_bench, first: int):
    bench = make_bench()
    bench.power_on()
    bench.run(10 * MS)
    assert bench.request(1, bytes([first, *bytes(7)])).hex() == "8000000001000405"
    assert bench.read(0x1018, 1) == 0x41584953


def test_a_segment_after_the_end_of_a_transfer_is_aborted(bench):
    assert bench.request(1, bytes.fromhex("4018100100000000"))[0] == 0x43  # expedited: nothing follows
    assert bench.request(1, bytes([0x60, *bytes(7)])).hex() == "8000000001000405"
    assert bench.request(1, bytes.fromhex("2185600004000000"))[0] == 0x60
    assert bench.request(1, bytes([0x07, 1, 0, 0, 0, 0, 0, 0]))[0] == 0x20  # the last one
    assert bench.request(1, bytes([0x17, 1, 0, 0, 0, 0, 0, 0])).hex() == "8000000001000405"


def test_an_abort_of_the_client_ends_its_transfer(bench):
    assert bench.request(1, bytes.fromhex("4008100000000000"))[0] == 0x41
    bench.send(0x601, bytes.fromhex("8008100000000008"))
    assert [can_id for _, can_id, _ in bench.run(20 * MS)] == [0x601]
    assert bench.request(1, bytes([0x60, *bytes(7)])).hex() == "8000000001000405"


def test_a_toggle_bit_that_does_not_alternate_is_aborted(bench):
    assert bench.request(1, bytes.fromhex("4008100000000000"))[0] == 0x41
    assert bench.request(1, bytes([0x60, *bytes(7)]))[0] == 0x00
    assert bench.request(1, bytes([0x60, *bytes(7)])).hex() == "8008100000000305"


@pytest.mark.parametrize("length", range(8))
def test_short_sdo_frames_are_ignored(bench, length: int):
    bench.send(0x601, b"\x40\x18\x10\x01\x00\x00\x00"[:length])
    assert [can_id for _, can_id, _ in bench.run(20 * MS)] == [0x601]
    assert bench.read(0x1018, 1) == 0x41584953


def test_stored_parameters_outlive_a_reset_and_restored_ones_do_not(bench):
    save, load = int.from_bytes(b"save", "little"), int.from_bytes(b"load", "little")
    assert bench.write(0x1017, 0, 50, 2) == 0
    assert bench.write(0x1010, 1, save, 4) == 0
    assert bench.write(0x1017, 0, 70, 2) == 0
    bench.send(0x000, b"\x81\x01")
    bench.run(10 * MS)
    assert bench.read(0x1017) == 50
    assert bench.write(0x1011, 1, load, 4) == 0
    assert bench.read(0x1017) == 50
    bench.send(0x000, b"\x81\x01")
    bench.run(10 * MS)
    assert bench.read(0x1017) == 100


def test_drives_are_told_apart(make_bench):
    bench = make_bench(drives=2)
    bench.power_on()
    bench.run(10 * MS)
    assert bench.read(0x1018, 4, node=1) != bench.read(0x1018, 4, node=2)
    assert bench.read(0x1800, 1, node=2) == 0x182


def test_process_data_is_live_by_sdo(bench):
    assert bench.read(0x6041) == 0x0650
    assert bench.read(0x6064, signed=True) == 0
    assert bench.read(0x6502) == 0xA0
    assert bench.write(0x607A, 0, -5, 4) == 0
    assert bench.read(0x607A, signed=True) == -5
    assert bench.read(0x1001) == 0
    assert bench.read(0x1003, 0) == 0
    assert bench.abort_of(0x1003, 1) == 0x08000024
