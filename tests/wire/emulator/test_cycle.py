"""SYNC, RPDO, TPDO: which frame, when, and from which setpoint."""

import struct

import pytest

MS = 1_000_000


def tpdo(frames, node: int = 1) -> tuple[int, int]:
    """Statusword and position of the one TPDO1 among the frames."""
    (data,) = [data for _, can_id, data in frames if can_id == 0x180 + node]
    return struct.unpack("<Hi", data)


def test_tpdo_only_in_operational(bench):
    assert [can_id for _, can_id, _ in bench.cycle()] == [0x080]
    bench.start()
    frames = bench.cycle()
    assert [(can_id, data.hex()) for _, can_id, data in frames] == [(0x080, "02"), (0x181, "500600000000")]


def test_response_time_and_wire_time_of_a_tpdo(bench):
    bench.start()
    frames = bench.cycle()
    (sync_at, *_), (tpdo_at, _, data) = frames
    from axisync_emulator.simcan.wire import frame_bits  # the wire's own length is tested elsewhere

    assert tpdo_at - sync_at == 20_000 + 1000 * frame_bits(0x181, data)


def test_the_way_to_operation_enabled_frame_by_frame(bench):
    bench.start()
    seen = [tpdo(bench.cycle(word, 0))[0] for word in (0x06, 0x07, 0x0F, 0x0F, 0x0F)]
    assert seen == [0x0650, 0x0631, 0x0633, 0x1637, 0x1637]


def test_enable_in_one_step_from_ready(bench):
    bench.start()
    seen = [tpdo(bench.cycle(word, 0))[0] & 0x6F for word in (0x06, 0x0F, 0x0F)]
    assert seen == [0x40, 0x21, 0x27]


def test_target_moves_the_demand_from_the_next_sync_on(enabled):
    bench, at = enabled
    assert bench.read(0x6062, signed=True) == at
    bench.cycle(0x0F, at + 100)
    # The RPDO waits for a SYNC, however long after it one asks.
    assert bench.read(0x6062, signed=True) == at
    bench.cycle(0x0F, at + 100)
    bench.cycle(0x0F, at + 100)
    assert bench.read(0x6062, signed=True) == at + 100


def test_demand_is_interpolated_over_the_period(enabled):
    bench, at = enabled
    bench.cycle(0x0F, at + 200)
    bench.counter += 1
    bench.send(0x080, bytes([bench.counter]))
    bench.run(100_000)
    sync_at = next(t for t, can_id, _ in reversed(bench.recorder.frames) if can_id == 0x080)
    demand = bench.drive.motor.demand
    assert demand.at(sync_at) == pytest.approx(at)
    assert demand.at(sync_at + 1 * MS) == pytest.approx(at + 100)
    assert demand.at(sync_at + 2 * MS) == pytest.approx(at + 200)


def test_the_axis_arrives_within_one_count(enabled):
    bench, at = enabled
    for k in range(1, 101):
        bench.cycle(0x0F, at + 100 * k)
    for _ in range(30):
        frames = bench.cycle(0x0F, at + 10_000)
    assert abs(tpdo(frames)[1] - (at + 10_000)) <= 1
    assert tpdo(frames)[0] == 0x1637


def test_position_is_sampled_at_the_sync(enabled):
    bench, at = enabled
    for k in range(1, 51):
        frames = bench.cycle(0x0F, at + 100 * k)
    sampled = tpdo(frames)[1]
    sync_at = next(t for t, can_id, _ in frames if can_id == 0x080)
    model = bench.drive.motor
    # The axis has gone on since: by one period at 50,000 counts/s, less what it lags behind.
    assert model.position(sync_at + 2 * MS) - sampled == pytest.approx(100, abs=2)


def test_doubled_sync_and_doubled_rpdo_make_no_double_step(enabled):
    bench, at = enabled
    bench.cycle(0x0F, at + 100)
    bench.send(0x201, struct.pack("<Hi", 0x0F, at + 100))
    bench.run(1 * MS)
    bench.counter += 1
    for _ in range(2):
        bench.send(0x080, bytes([bench.counter]))
    frames = bench.run(2 * MS)
    assert [can_id for _, can_id, _ in frames] == [0x080, 0x080, 0x181]
    assert bench.drive.motor.demand.velocity == pytest.approx(50_000, rel=2e-3)


def test_rpdo_of_a_skipped_tick_is_never_replayed(enabled):
    bench, at = enabled
    bench.cycle(0x0F, at + 100)
    bench.cycle(skip=1)
    assert bench.drive.profile.csp.target == at
    assert bench.drive.motor.demand.velocity == 0.0


def test_rpdo_after_the_sync_window_counts_as_lost(enabled):
    bench, at = enabled
    assert bench.write(0x1007, 0, 500, 4) == 0
    bench.cycle(0x0F, at)
    bench.counter += 1
    bench.send(0x080, bytes([bench.counter]))
    bench.run(700_000)
    bench.send(0x201, struct.pack("<Hi", 0x0F, at + 100))
    bench.run(1_300_000)
    bench.cycle()
    assert bench.drive.profile.csp.target == at


def test_second_tpdo_every_sixth_sync_from_its_start_value(bench):
    for row in ((0x1801, 1, 0x80000281, 4), (0x1801, 2, 6, 1), (0x1801, 6, 3, 1), (0x1801, 1, 0x281, 4)):
        assert bench.write(*row) == 0
    bench.start()
    sent = [any(can_id == 0x281 for _, can_id, _ in bench.cycle()) for _ in range(20)]
    assert [counter for counter, is_sent in enumerate(sent, 1) if is_sent] == [3, 9, 15]


def test_velocity_and_torque_in_the_second_tpdo(enabled):
    bench, at = enabled
    for row in ((0x1801, 1, 0x80000281, 4), (0x1801, 2, 1, 1), (0x1801, 1, 0x281, 4)):
        assert bench.write(*row) == 0
    for k in range(1, 101):
        frames = bench.cycle(0x0F, at + 100 * k)
    (data,) = [data for _, can_id, data in frames if can_id == 0x281]
    velocity, torque = struct.unpack("<ih", data)
    assert velocity == pytest.approx(50_000, abs=5)
    assert torque == pytest.approx(20 + 2.5, abs=3)  # friction, Coulomb's and viscous


def test_mapping_written_by_sdo_is_what_is_sent_and_understood(bench):
    for row in (
        (0x1800, 1, 0x80000181, 4), (0x1A00, 0, 0, 1), (0x1A00, 1, 0x60640020, 4), (0x1A00, 2, 0x60610008, 4),
        (0x1A00, 3, 0x60410010, 4), (0x1A00, 0, 3, 1), (0x1800, 1, 0x1F0, 4),
        (0x1400, 1, 0x80000201, 4), (0x1600, 0, 0, 1), (0x1600, 1, 0x607A0020, 4), (0x1600, 2, 0x60400010, 4),
        (0x1600, 0, 2, 1), (0x1400, 1, 0x3A0, 4),
    ):  # fmt: skip
        assert bench.write(*row) == 0
    bench.start()
    bench.cycle()
    bench.send(0x3A0, struct.pack("<iH", -7, 0x06))
    bench.send(0x201, struct.pack("<Hi", 0x06, 99))  # the old identifier means nothing any more
    bench.run(1 * MS)
    frames = bench.cycle()
    (data,) = [data for _, can_id, data in frames if can_id == 0x1F0]
    assert struct.unpack("<ibH", data) == (0, 8, 0x0631)
    assert bench.drive.profile.csp.target == -7
    assert not [can_id for _, can_id, _ in frames if can_id == 0x181]


def test_position_wraps_without_a_jump(bench):
    # A drive whose actual position is at the end of the INTEGER32 range.
    bench.drive.motor._model.position = float(2**31 - 150)
    bench.drive.motor._braking.rest(float(2**31 - 150), 0)
    bench.start()
    at = bench.enable()
    assert at == 2**31 - 150
    for k in range(1, 101):
        frames = bench.cycle(0x0F, (at + 10 * k + 2**31) % 2**32 - 2**31)
    for _ in range(20):
        frames = bench.cycle(0x0F, (at + 1000 + 2**31) % 2**32 - 2**31)
    status, position = tpdo(frames)
    assert status & 0x6F == 0x27
    assert (position - (at + 1000)) % 2**32 == 0
    assert position < 0
