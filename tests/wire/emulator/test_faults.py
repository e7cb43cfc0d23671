"""Every kind of fault, seen in the frames of one bus."""

import itertools
import struct

import pytest

from axisync_emulator.faults.model import FaultError
from axisync_emulator.simcan.wire import frame_bits

MS = 1_000_000
PERIOD = 2 * MS


def moving(bench, at: int, cycles: int = 60, first: int = 1) -> list[tuple[int, int, bytes]]:
    return [frame for k in range(first, first + cycles) for frame in bench.cycle(0x0F, at + 100 * k)]


def ids(frames) -> list[int]:
    return [can_id for _, can_id, _ in frames]


def positions(frames, node: int = 1) -> list[int]:
    return [struct.unpack("<Hi", data)[1] for _, can_id, data in frames if can_id == 0x180 + node]


def codes(bench, frames) -> list[int]:
    return [code for _, code, _ in bench.emergencies(frames)]


# On the wire.


def test_lost_rpdos_are_extrapolated_over(enabled):
    bench, at = enabled
    bench.inject("lose", id=0x201, skip=20, count=5)
    frames = moving(bench, at, 60)
    assert ids(frames).count(0x201) == 55
    assert codes(bench, frames) == []
    assert bench.state() == 0x27


def test_one_more_stops_the_drive(enabled):
    bench, at = enabled
    bench.inject("lose", id=0x201, skip=20, count=6)
    assert codes(bench, moving(bench, at, 60)) == [0x8250, 0x0000]
    assert bench.state() in (0x07, 0x40)


def test_sync_lost_for_good(enabled):
    bench, at = enabled
    moving(bench, at, 20)
    bench.inject("lose", id=0x080)
    frames = moving_without_sync(bench, at)
    assert 0x080 not in ids(frames)
    assert codes(bench, frames) == [0x8700]


def moving_without_sync(bench, at: int, cycles: int = 30) -> list[tuple[int, int, bytes]]:
    frames = []
    for k in range(cycles):
        bench.counter = bench.counter % 240 + 1
        bench.send(0x080, bytes([bench.counter]))
        frames += bench.run(100_000)
        bench.send(0x201, struct.pack("<Hi", 0x0F, at + 100 * k))
        frames += bench.run(PERIOD - 100_000)
    return frames


def test_probability_and_seed(make_bench):
    def lost(seed: int) -> list[int]:
        bench = make_bench()
        bench.injector._seed = seed
        bench.inject("lose", id=0x123, probability=0.3)
        for k in range(200):
            bench.send(0x123, struct.pack("<H", k))
            bench.run(MS)
        kept = {struct.unpack("<H", data)[0] for _, can_id, data in bench.recorder.frames if can_id == 0x123}
        return [k for k in range(200) if k not in kept]

    first = lost(1)
    assert 30 < len(first) < 90
    assert lost(1) == first
    assert lost(2) != first


def test_delayed_frames_are_late_and_overtaken(bench):
    bench.inject("delay", id=0x123, delay_s=0.003, count=1)
    sent = bench.now
    bench.send(0x123, b"\x01")
    bench.send(0x123, b"\x02")
    frames = bench.run(10 * MS)
    assert [data for _, _, data in frames] == [b"\x02", b"\x01"]
    assert frames[1][0] == sent + 3 * MS + 1000 * frame_bits(0x123, b"\x01")


def test_an_rpdo_delayed_past_the_sync_window_counts_as_lost(enabled):
    bench, at = enabled
    assert bench.write(0x1007, 0, 500, 4) == 0
    for k in range(3):
        bench.cycle(0x0F, at + k)
    bench.inject("delay", id=0x201, delay_s=0.0007, count=1)
    bench.cycle(0x0F, at + 100)
    bench.cycle(0x0F, at + 2)
    assert bench.drive.profile.csp.target == at + 2 or bench.drive.profile.csp.target == at + 1
    assert bench.drive.cyclic._missed == 1


def test_duplicates_make_no_double_step(enabled):
    bench, at = enabled
    bench.inject("duplicate", id=0x080, probability=0.5)
    bench.inject("duplicate", id=0x201, copies=2, after_s=0.0001)
    frames = moving(bench, at, 80)
    assert ids(frames).count(0x201) == 240
    assert 90 < ids(frames).count(0x080) < 150
    assert len(positions(frames)) == 80
    assert positions(frames)[-1] - positions(frames)[-2] == pytest.approx(100, abs=3)
    assert codes(bench, frames) == []


def test_a_flipped_bit_of_a_target_is_refused_by_the_drive(enabled):
    bench, at = enabled
    moving(bench, at)
    bench.inject("flip", id=0x201, bit=16 + 20, count=1)
    frames = moving(bench, at, 3, first=61)
    (flipped,) = [data for _, can_id, data in frames if can_id == 0x201 and abs(_target(data) - at) > 50_000]
    assert _target(flipped) == at + 6100 ^ 1 << 20
    assert codes(bench, frames) == [0xFF01]
    assert bench.state() in (0x0F, 0x08)


def _target(data: bytes) -> int:
    return struct.unpack("<Hi", data)[1]


def test_a_corrupted_frame_costs_an_error_frame_and_is_sent_again(bench):
    bench.inject("corrupt", id=0x123, count=3)
    before = bench.hub.medium.bits
    sent = bench.now
    bench.send(0x123, bytes(8))
    bench.send(0x124, b"")
    frames = bench.run(5 * MS)
    assert ids(frames) == [0x123, 0x124]
    whole = frame_bits(0x123, bytes(8))
    errors = bench.hub.medium.bits - before - whole - frame_bits(0x124, b"") - 6
    assert 3 * (19 + 20 + 3) <= errors <= 3 * (whole + 20 + 3)
    assert frames[0][0] == sent + 1000 * (errors + whole)


def test_ever_new_errors_end_in_bus_off_and_a_restart(make_bench):
    bench = make_bench(drives=2)
    bench.power_on()
    bench.run(10 * MS)
    bench.inject("corrupt", id=0x701, count=32)
    frames = bench.run(450 * MS)
    times = [at for at, can_id, _ in frames if can_id == 0x701]
    # One heartbeat was lost with the bus-off, one more in the 100 ms until the controller was back.
    assert len(times) == ids(frames).count(0x702) - 2
    assert [data[:3].hex() for _, can_id, data in frames if can_id == 0x081] == ["408100"]


def test_bus_off_of_a_drive(enabled):
    bench, at = enabled
    moving(bench, at, 20)
    bench.inject("bus_off", node=1, duration_s=0.3)
    frames = moving(bench, at, 100, first=21)
    assert positions(frames) == []
    assert bench.drive.profile.state in (0x07, 0x40)
    frames = bench.run(200 * MS)
    assert codes(bench, frames)[0] == 0x8140
    assert bench.state() == 0x40


@pytest.mark.parametrize(("can_id", "data"), [(0x080, "05"), (0x000, "8001")])
def test_a_babbling_node(enabled, can_id: int, data: str):
    bench, at = enabled
    bench.inject("babble", id=can_id, data=data, period_s=0.0003, duration_s=0.01)
    frames = moving(bench, at, 10)
    assert len([frame for frame in frames if frame[1] == can_id and frame[2].hex() == data]) >= 30
    assert bench.drive.nmt == (0x7F if can_id == 0 else 0x05)
    assert not [frame for frame in moving(bench, at, 5) if frame[1] == can_id and frame[2].hex() == data][1:]


def test_a_babbling_idiot_leaves_no_room_for_others(enabled):
    bench, at = enabled
    bench.inject("babble", id=0x001, data="0000000000000000", period_s=0.00001, duration_s=0.05)
    frames = moving_without_sync(bench, at, 20)
    assert ids(frames).count(0x001) > 250
    assert ids(frames).count(0x080) <= 1
    assert bench.hub.medium.load > 0


# When.


def test_at_a_time_for_a_time(make_bench):
    bench = make_bench()
    bench.inject("mute", at_s=0.25, duration_s=0.3)
    bench.power_on()
    began = bench.now
    beats = [round((at - began) / MS) for at, can_id, data in bench.run(1000 * MS) if can_id == 0x701]
    assert beats == [0, 100, 200, 600, 700, 800, 900, 1000] or beats == [0, 100, 200, 600, 700, 800, 900]


def test_from_one_sync_to_another(enabled):
    bench, at = enabled
    seen = bench.injector._places["kingkong"].syncs
    bench.inject("mute", id=0x181, at_sync=seen + 10, syncs=3)
    answered = [bool(positions(bench.cycle(0x0F, at))) for _ in range(20)]
    assert [k for k, answer in enumerate(answered, 1) if not answer] == [10, 11, 12]


def test_cancelled_before_and_while_it_acts(enabled):
    bench, at = enabled
    never = bench.inject("mute", id=0x181, at_s=1000.0)
    bench.injector.cancel(never)
    number = bench.inject("mute", id=0x181)
    assert positions(moving(bench, at, 3)) == []
    bench.injector.cancel(number)
    assert len(positions(moving(bench, at, 3))) == 3
    assert [injected.as_dict()["stage"] for injected in bench.injector.injected] == ["over", "over"]
    with pytest.raises(FaultError, match="fault 77"):
        bench.injector.cancel(77)


@pytest.mark.parametrize(("fault", "message"), [
    ({"kind": "reset", "bus": "godzilla", "node": 1}, "bus 'godzilla' is none of kingkong"),
    ({"kind": "reset", "bus": "kingkong", "node": 9}, "node 9 is none of 1 on bus kingkong"),
])  # fmt: skip
def test_what_is_not_there(bench, fault: dict[str, object], message: str):
    with pytest.raises(FaultError, match=message):
        bench.inject(**fault)


# In a drive.


def test_deaf_to_its_rpdo(enabled):
    bench, at = enabled
    bench.inject("deaf", id=0x201, duration_s=0.03)
    assert codes(bench, moving(bench, at, 30)) == [0x8250, 0x0000]


def test_power_cycle(enabled):
    bench, at = enabled
    last = moving(bench, at, 50)
    assert positions(last)[-1] > 4000
    bench.inject("power_cycle", duration_s=0.2)
    frames = moving(bench, at, 99, first=51)
    assert [can_id for can_id in ids(frames) if can_id not in (0x080, 0x201)] == []
    frames = bench.run(10 * MS)
    assert [(can_id, data) for _, can_id, data in frames] == [(0x701, b"\x00")]
    assert bench.read(0x6064, signed=True) > 4000
    assert bench.state() == 0x40
    assert bench.read(0x1006) == 0
    assert bench.read(0x1003, 0) == 0


def test_power_cycle_of_an_incremental_encoder_loses_the_position(enabled):
    bench, at = enabled
    moving(bench, at, 50)
    mechanical = bench.drive.motor.mechanical(bench.now)
    bench.inject("power_cycle", duration_s=0.2, encoder="incremental")
    bench.run(300 * MS)
    assert bench.read(0x6064, signed=True) == 0
    assert bench.drive.motor.mechanical(bench.now) == pytest.approx(mechanical, abs=600)


def test_reset_in_motion(enabled):
    bench, at = enabled
    moving(bench, at, 30)
    bench.inject("reset")
    frames = moving(bench, at, 30, first=31)
    assert [data for _, can_id, data in frames if can_id == 0x701] == [b"\x00"]
    assert positions(frames) == []
    assert bench.state() == 0x40


def test_frozen_actuals(enabled):
    bench, at = enabled
    before = positions(moving(bench, at, 30))
    bench.inject("freeze", syncs=20)
    frozen = positions(moving(bench, at, 20, first=31))
    assert len(set(frozen)) == 1
    assert frozen[0] == pytest.approx(before[-1] + 100, abs=3)
    after = positions(moving(bench, at, 20, first=51))
    assert after[-1] == pytest.approx(frozen[0] + 100 * 39, abs=10)


def test_jumping_actuals(enabled):
    bench, at = enabled
    before = positions(moving(bench, at, 30))
    bench.inject("jump", counts=-5000)
    after = positions(moving(bench, at, 2, first=31))
    assert after[0] - before[-1] == pytest.approx(-4900, abs=3)
    assert bench.read(0x6064, signed=True) < 0


def test_wrong_identity(bench):
    number = bench.inject("identity", product_code=0x99, serial=7)
    bench.run(MS)
    assert [bench.read(0x1018, sub) for sub in (1, 2, 4)] == [0x41584953, 0x99, 7]
    bench.injector.cancel(number)
    assert bench.read(0x1018, 2) == 1


@pytest.mark.parametrize(("code", "register"), [(0x2310, 0x03), (0x3210, 0x05), (0x7121, 0x01), (0xFF77, 0x81)])
def test_emergency_of_any_code_is_a_fault_until_reset(enabled, code: int, register: int):
    bench, at = enabled
    bench.inject("emergency", code=code)
    frames = moving(bench, at, 2)
    assert [entry[1:] for entry in bench.emergencies(frames)] == [(code, register)]
    for _ in range(10):
        bench.cycle(0x00, at)
    assert bench.state() == 0x08
    assert bench.read(0x603F) == code
    assert bench.read(0x1003, 1) == code
    frames = bench.cycle(0x80, at) + bench.cycle(0x80, at)
    assert bench.state() == (0x08 if code == 0x3210 else 0x40)  # an over-voltage stays as long as its cause


def test_an_emergency_with_a_cause_can_be_reset_when_that_has_gone(enabled):
    bench, at = enabled
    number = bench.inject("emergency", code=0x4310)
    moving(bench, at, 2)
    bench.injector.cancel(number)
    assert bench.read(0x1001) == 0
    for controlword in (0x00, 0x80, 0x00):
        bench.cycle(controlword, at)
    assert bench.state() == 0x40


def test_emergency_as_a_warning(enabled):
    bench, at = enabled
    bench.inject("emergency", code=0x4210, warning=True, syncs=5)
    assert codes(bench, moving(bench, at, 10)) == [0x4210, 0x0000]
    assert bench.state() == 0x27


def test_no_heartbeat(enabled):
    bench, at = enabled
    number = bench.inject("no_heartbeat")
    frames = moving(bench, at, 150)
    assert 0x701 not in ids(frames)
    assert len(positions(frames)) == 150
    bench.injector.cancel(number)
    assert 0x701 in ids(moving(bench, at, 60, first=151))


def test_sdo_abort_and_silence(bench):
    number = bench.inject("sdo", index=0x6085, abort=0x06040043)
    bench.run(MS)
    assert bench.write(0x6085, 0, 1000, 4) == 0x06040043
    assert bench.abort_of(0x6085) == 0x06040043
    bench.injector.cancel(number)
    assert bench.write(0x6085, 0, 1000, 4) == 0
    bench.inject("sdo", index=0x1018, sub=1)
    bench.run(MS)
    bench.send(0x601, bytes.fromhex("4018100100000000"))
    assert ids(bench.run(50 * MS)) == [0x601]
    assert bench.read(0x1018, 2) == 1


def test_drifting_clock(make_bench):
    bench = make_bench()
    bench.inject("drift", ppm=10_000)
    bench.power_on()
    times = [at for at, can_id, _ in bench.run(550 * MS) if can_id == 0x701]
    assert {b - a for a, b in itertools.pairwise(times[1:])} == {round(100 * MS / 1.01)}


def test_safe_torque_off_in_motion(enabled):
    bench, at = enabled
    moving(bench, at, 50)
    number = bench.inject("sto")
    frames = moving(bench, at, 1, first=51)
    assert [entry[1:] for entry in bench.emergencies(frames)] == [(0x5441, 0x01)]
    assert bench.state() == 0x08
    assert not bench.drive.motor.torque_on
    assert (bench.read(0x2001), bench.read(0x60FD) & 0x8, bench.read(0x1002) & 1) == (1, 8, 1)
    assert bench.read(0x60FE, 1) & 1
    for word in (0x00, 0x80):
        bench.cycle(word, at)
    bench.cycle(0x80, at)
    assert bench.state() == 0x08  # while it is asked for, no reset
    bench.injector.cancel(number)
    for word in (0x00, 0x80, 0x80):
        bench.cycle(word, at)
    assert bench.state() == 0x40
    assert bench.read(0x2001) == 0


def test_safe_torque_off_before_enable(bench):
    bench.start()
    for word in (0x06, 0x07, 0x07):
        bench.cycle(word, 0)
    assert bench.state() == 0x23
    number = bench.inject("sto")
    for word in (0x07, 0x06, 0x06, 0x07, 0x0F, 0x0F):
        bench.cycle(word, 0)
    assert bench.state() == 0x40
    bench.injector.cancel(number)
    bench.cycle(0x06, 0)
    for word in (0x00, 0x06, 0x07, 0x0F, 0x0F):
        bench.cycle(word, 0)
    assert bench.state() == 0x27


def test_over_temperature_warns_then_stops(enabled):
    bench, at = enabled
    assert bench.read(0x2003) == 300
    number = bench.inject("temperature", celsius=95.0, per_s=200.0)
    frames = [frame for _ in range(130) for frame in bench.cycle(0x0F, at)]  # 260 ms: 82 degrees
    assert codes(bench, frames) == []
    assert bench.read(0x6041) & 0x80
    assert 800 < bench.read(0x2003) < 900
    assert bench.read(0x1002) & 4
    frames = [frame for _ in range(40) for frame in bench.cycle(0x0F, at)]
    assert [entry[1:] for entry in bench.emergencies(frames)] == [(0x4310, 0x09)]
    bench.injector.cancel(number)
    frames = [frame for _ in range(100) for frame in bench.cycle(0x00, at)]
    assert codes(bench, frames) == [0x0000]
    assert bench.state() == 0x08
    for word in (0x80, 0x80):
        bench.cycle(word, at)
    assert bench.state() == 0x40


@pytest.mark.parametrize(("volts", "code"), [(65.0, 0x3210), (20.0, 0x3220)])
def test_dc_link_voltage(enabled, volts: float, code: int):
    bench, at = enabled
    assert bench.read(0x6079) == 48_000
    bench.inject("voltage", volts=volts)
    frames = moving(bench, at, 2)
    assert [entry[1:] for entry in bench.emergencies(frames)] == [(code, 0x05)]
    assert bench.read(0x6079) == 1000 * volts


def test_a_jammed_axis_is_a_following_error(enabled):
    bench, at = enabled
    assert bench.write(0x6065, 0, 1000, 4) == 0
    assert bench.write(0x6066, 0, 20, 2) == 0
    moving(bench, at, 30)
    bench.inject("jam")
    frames = moving(bench, at, 40, first=31)
    assert codes(bench, frames) == [0x8611]
    assert len(set(positions(frames)[1:])) <= 3  # noise


def test_leaving_csp(enabled):
    bench, at = enabled
    moving(bench, at, 30)
    bench.inject("leave_mode")
    frames = moving(bench, at, 3, first=31)
    words = [struct.unpack("<Hi", data)[0] for _, can_id, data in frames if can_id == 0x181]
    assert words[-1] & 0x6F == 0x27
    assert not words[-1] & 0x1000
    assert bench.read(0x6061) == 0


def test_a_stuck_switch(bench):
    bench.inject("input", input="negative_limit", active=True)
    bench.run(MS)
    assert bench.read(0x60FD) & 0x1


def test_two_nodes_with_one_id(make_bench):
    bench = make_bench()
    bench.power_on()
    bench.run(10 * MS)
    number = bench.inject("twin")
    frames = bench.run(5 * MS)
    assert [(can_id, data) for _, can_id, data in frames] == [(0x701, b"\x00")]
    bench.send(0x601, bytes.fromhex("4018100400000000"))
    answers = [data[4:] for _, can_id, data in bench.run(5 * MS) if can_id == 0x581]
    assert len(set(answers)) == len(answers) == 2
    bench.injector.cancel(number)
    assert bench.read(0x1018, 4) == 1 << 16 | 1


def test_faults_of_one_drive_leave_the_others_alone(make_bench):
    bench = make_bench(drives=2)
    bench.power_on()
    bench.inject("mute", node=2)
    assert set(ids(bench.run(450 * MS))) == {0x701, 0x702}  # boot-up came before
    assert ids(bench.run(500 * MS)).count(0x701) == 5
