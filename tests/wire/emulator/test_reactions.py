"""What a drive does when something is missing or wrong: which frame, which state, and when."""

import pytest

MS = 1_000_000
PERIOD = 2 * MS
N = 5
SLOWING = 262_144  # counts/s^2
JITTER = 100
"""Counts/s at 50,000: SYNCs differ by a few stuff bits, so their ends are not quite 2 ms apart."""


def moving(bench, at: int, step: int = 100, cycles: int = 60) -> int:
    """Under way at constant velocity; the last target sent."""
    for k in range(1, cycles + 1):
        bench.cycle(0x0F, at + step * k)
    return at + step * cycles


def velocity(bench, now: int | None = None) -> float:
    return bench.drive.motor.demand.velocity_at(bench.now if now is None else now)


def test_up_to_n_missing_rpdos_are_extrapolated(enabled):
    bench, at = enabled
    last = moving(bench, at)
    for _ in range(N):
        bench.cycle()
    assert bench.drive.profile.enabled
    for k in range(N + 1, 60):
        bench.cycle(0x0F, last + 100 * k)
    assert bench.emergencies(bench.recorder.frames) == []
    assert velocity(bench) == pytest.approx(50_000, abs=JITTER)
    # At a SYNC the target of the cycle before has been reached.
    assert bench.drive.motor.demand.at(bench.sync_at) == pytest.approx(last + 100 * 57, abs=1)


def test_more_than_n_missing_rpdos_stop_the_drive(enabled):
    bench, at = enabled
    moving(bench, at)
    # The first of these SYNCs still makes the last RPDO valid.
    frames = [frame for _ in range(N + 2) for frame in bench.cycle()]
    ((_, code, register),) = bench.emergencies(frames)
    assert (code, register) == (0x8250, 0x11)
    assert bench.state() == 0x07


def test_rpdo_timer_stops_the_drive_between_syncs(enabled):
    bench, at = enabled
    assert bench.write(0x1400, 5, 5, 2) == 0
    moving(bench, at)
    last = max(t for t, can_id, _ in bench.recorder.frames if can_id == 0x201)
    frames = [frame for _ in range(4) for frame in bench.cycle()]
    ((when, code, _),) = bench.emergencies(frames)
    assert code == 0x8250
    assert 5 * MS <= when - last <= 5 * MS + 300_000


def test_lost_sync_begins_the_ramp_within_n_plus_two_cycles(enabled):
    bench, at = enabled
    moving(bench, at)
    since = bench.sync_at
    frames = bench.run(50 * MS)
    (when, code, register), *_ = bench.emergencies(frames)
    assert (code, register) == (0x8700, 0x11)
    assert (N + 1) * PERIOD < when - since < (N + 2) * PERIOD
    ramp_began = bench.drive.motor.demand.since
    assert (N + 1) * PERIOD < ramp_began - since <= (N + 2) * PERIOD
    # Until then it went on as before, from then on it slows at 0x6085.
    assert velocity(bench, ramp_began) == pytest.approx(50_000, abs=JITTER)
    assert velocity(bench, ramp_began + 10 * MS) == pytest.approx(50_000 - SLOWING * 0.01, abs=JITTER)
    assert bench.state() == 0x07
    bench.run(200 * MS)
    assert bench.state() == 0x40
    assert bench.read(0x603F) == 0x8700
    assert [bench.read(0x1003, sub) for sub in (0, 1)] == [1, 0x8700]
    assert bench.drive.motor.velocity(bench.now) == 0


def test_a_drive_that_holds_stands_while_it_misses(make_bench):
    bench = make_bench(on_missed="hold")
    bench.power_on()
    bench.configure()
    bench.start()
    last = moving(bench, bench.enable())
    bench.cycle()
    for _ in range(N - 1):
        bench.cycle()
    assert bench.drive.motor.demand.at(bench.now) == pytest.approx(last)
    assert velocity(bench) == 0.0
    assert bench.drive.profile.enabled


def test_stopped_drive_does_not_move_again_by_itself(enabled):
    bench, at = enabled
    last = moving(bench, at)
    bench.run(300 * MS)
    stopped = bench.read(0x6064, signed=True)
    # The master is back and goes on as if nothing had been: the counter skips, and the state is not left.
    for k in range(1, 30):
        bench.cycle(0x0F, last + 100 * k, skip=10 if k == 1 else 0)
    assert bench.state() == 0x40
    assert bench.read(0x6064, signed=True) == stopped
    assert bench.read(0x1001) == 0


def test_lost_heartbeat_of_the_master(enabled):
    bench, at = enabled
    assert bench.write(0x1016, 1, 127 << 16 | 60, 4) == 0
    bench.cycle(0x0F, at, heartbeat=True)
    last = max(t for t, can_id, _ in bench.recorder.frames if can_id == 0x77F)
    frames = [frame for k in range(1, 41) for frame in bench.cycle(0x0F, at + 100 * k)]
    ((when, code, register),) = bench.emergencies(frames)
    assert (code, register) == (0x8130, 0x11)
    assert 60 * MS <= when - last <= 60 * MS + 300_000
    assert bench.state() in (0x07, 0x40)
    # 0x1029:1 = 1: still operational.
    assert bench.cycle()[-1][1] == 0x181
    frames = bench.cycle(0x00, at, heartbeat=True)
    assert [entry[1:] for entry in bench.emergencies(frames)] == [(0x0000, 0x00)]


def test_no_enable_without_the_masters_heartbeat(bench):
    assert bench.write(0x1016, 1, 127 << 16 | 60, 4) == 0
    bench.start()
    bench.cycle(0x06, 0, heartbeat=True)
    for word in (0x06,) * 40 + (0x07, 0x07, 0x0F, 0x0F, 0x0F):
        bench.cycle(word, 0)
    assert bench.state() == 0x23
    bench.cycle(0x0F, 0, heartbeat=True)
    bench.cycle(0x0F, 0)
    assert bench.state() == 0x27


@pytest.mark.parametrize(("behaviour", "state"), [(0, 0x7F), (1, 0x05), (2, 0x04)])
def test_error_behaviour_after_a_lost_heartbeat(enabled, behaviour: int, state: int):
    bench, at = enabled
    assert bench.write(0x1029, 1, behaviour, 1) == 0
    assert bench.write(0x1016, 1, 127 << 16 | 10, 4) == 0
    bench.cycle(0x0F, at, heartbeat=True)
    frames = [frame for _ in range(70) for frame in bench.cycle(0x0F, at)]
    assert [data for _, can_id, data in frames if can_id == 0x701][-1] == bytes([state])


@pytest.mark.parametrize(("option", "state"), [(0, 0x27), (1, 0x0F), (2, 0x40), (3, 0x07)])
def test_abort_connection_option(enabled, option: int, state: int):
    bench, at = enabled
    assert bench.write(0x6007, 0, option, 2) == 0
    moving(bench, at)
    bench.send(0x000, b"\x80\x01")
    bench.run(2 * MS)
    assert bench.state() == state


def test_implausible_target_is_refused_with_a_fault(enabled):
    bench, at = enabled
    last = moving(bench, at)
    bench.cycle(0x0F, last + 100 ^ 1 << 20)
    frames = bench.cycle(0x0F, last + 200)
    ((_, code, register),) = bench.emergencies(frames)
    assert (code, register) == (0xFF01, 0x81)
    assert bench.state() == 0x0F
    position = bench.read(0x6064, signed=True)
    bench.run(400 * MS)
    assert bench.state() == 0x08
    assert abs(bench.read(0x6064, signed=True) - position) < 50_000**2 / (2 * SLOWING) + 500


def test_fastest_plausible_motion_is_followed(enabled):
    bench, at = enabled
    step = int(1.4 * 30 / 360 * 2**20 * 0.002)
    for k in range(1, 50):
        bench.cycle(0x0F, at + step * k)
    assert bench.state() == 0x27


@pytest.mark.parametrize(("beyond", "refused"), [(0, False), (300, True)])
def test_after_a_gap_a_target_may_be_off_by_what_the_axis_can_have_braked(enabled, beyond: int, refused: bool):
    bench, at = enabled
    assert bench.write(0x2000, 0, 60, 1) == 0
    last, gap = moving(bench, at, step=100), 40
    for _ in range(gap):
        bench.cycle()
    braked = SLOWING * (gap * 0.002) ** 2 / 2
    step_max = 1.5 * 30 / 360 * 2**20 * 0.002
    target = last + 100 * (gap + 1) - int(braked + 0.9 * step_max) - beyond
    for k in range(3):
        bench.cycle(0x0F, target + 60 * k)
    assert (bench.state() != 0x27) is refused


def fault(bench, at: int) -> None:
    bench.cycle(0x0F, at + 100_000)
    bench.cycle(0x0F, at)
    bench.cycle(0x0F, at)


def test_fault_reset_needs_a_rising_edge(enabled):
    bench, at = enabled
    fault(bench, at)
    assert bench.state() == 0x08
    bench.cycle(0x80, at)
    bench.cycle(0x80, at)
    assert bench.state() == 0x40
    bench.cycle(0x06, at)
    for word in (0x06, 0x07, 0x0F, 0x8F, 0x8F):  # bit 7 is up when the fault comes
        bench.cycle(word, at)
    bench.cycle(0x8F, at + 100_000)
    for _ in range(5):
        bench.cycle(0x8F, at)
    assert bench.state() == 0x08
    bench.cycle(0x0F, at)
    frames = bench.cycle(0x80, at) + bench.cycle(0x80, at)
    assert bench.state() == 0x40
    assert [entry[1:] for entry in bench.emergencies(frames)] == [(0x0000, 0x00)]
    assert bench.read(0x603F) == 0


def test_following_error(enabled):
    bench, at = enabled
    assert bench.write(0x6065, 0, 150, 4) == 0
    assert bench.write(0x6066, 0, 20, 2) == 0
    # At 50,000 counts/s the axis lags 239 counts behind.
    frames = [frame for k in range(1, 30) for frame in bench.cycle(0x0F, at + 100 * k)]
    ((_, code, register),) = bench.emergencies(frames)
    assert (code, register) == (0x8611, 0x21)
    bench.run(400 * MS)
    assert bench.state() == 0x08


def test_no_following_error_inside_the_window(enabled):
    bench, at = enabled
    assert bench.write(0x6065, 0, 300, 4) == 0
    assert bench.write(0x6066, 0, 20, 2) == 0
    moving(bench, at)
    assert bench.state() == 0x27


@pytest.mark.parametrize(("offset", "state"), [(5800, 0x27), (5900, 0x23), (-5800, 0x27), (-5900, 0x23)])
def test_enable_needs_a_target_near_the_actual_position(bench, offset: int, state: int):
    bench.start()
    for word in (0x06, 0x07, *(0x0F,) * 35):
        bench.cycle(word, offset)
    status = bench.read(0x6041)
    assert status & 0x6F == state
    assert bool(status & 0x80) == (state == 0x23)
    # It goes there, no faster than its plausible speed.
    assert abs(velocity(bench)) <= 1.51 * 30 / 360 * 2**20
    for _ in range(200):
        bench.cycle(0x0F, offset)
    assert bench.read(0x6064, signed=True) == (offset if state == 0x27 else 0)


def test_enable_needs_csp(bench):
    assert bench.write(0x6060, 0, 0, 1) == 0
    bench.start()
    for word in (0x06, 0x07, 0x0F, 0x0F):
        bench.cycle(word, 0)
    assert bench.state() == 0x23


@pytest.mark.parametrize(
    ("option", "slowing", "end"), [(1, 100_000, 0x40), (2, 262_144, 0x40), (5, 100_000, 0x07), (6, 262_144, 0x07)]
)
def test_quick_stop_options(enabled, option: int, slowing: int, end: int):
    bench, at = enabled
    assert bench.write(0x605A, 0, option, 2) == 0
    assert bench.write(0x6084, 0, 100_000, 4) == 0
    last = moving(bench, at)
    bench.cycle(0x02, last + 100)
    bench.cycle(0x02, last + 100)
    began = bench.drive.motor.demand.since
    assert velocity(bench, began + 10 * MS) == pytest.approx(50_000 - slowing * 0.01, abs=JITTER)
    assert bench.state() == 0x07
    for _ in range(260):
        bench.cycle(0x02, last)
    assert bench.state() == end


def test_quick_stop_option_0_and_disable_voltage_drop_the_torque(enabled):
    bench, at = enabled
    moving(bench, at)
    bench.cycle(0x00, at)
    bench.cycle(0x00, at)
    assert bench.state() == 0x40
    assert not bench.drive.motor.torque_on


@pytest.mark.parametrize(("word", "index", "end"), [(0x06, 0x605B, 0x21), (0x07, 0x605C, 0x23)])
@pytest.mark.parametrize("option", [0, 1])
def test_shutdown_and_disable_operation_options(enabled, word: int, index: int, end: int, option: int):
    bench, at = enabled
    assert bench.write(index, 0, option, 2) == 0
    last = moving(bench, at)
    bench.cycle(word, last + 100)
    bench.cycle(word, last + 100)
    during = bench.state()
    assert during == (0x27 if option else end)
    if option:
        assert not bench.read(0x6041) & 0x1000
    for _ in range(150):
        bench.cycle(word, last)
    assert bench.state() == end


def test_halt_stops_and_goes_on(enabled):
    bench, at = enabled
    last = moving(bench, at)
    for _ in range(120):
        bench.cycle(0x10F, last)
    assert bench.state() == 0x27
    assert not bench.read(0x6041) & 0x1000
    stopped = bench.read(0x6062, signed=True)
    for _ in range(30):
        bench.cycle(0x0F, stopped)
    assert bench.read(0x6041) & 0x1000
    assert bench.read(0x6064, signed=True) == pytest.approx(stopped, abs=1)


def test_software_limit_clamps(enabled):
    bench, at = enabled
    assert bench.write(0x607D, 2, at + 1000, 4) == 0
    for k in range(1, 60):
        bench.cycle(0x0F, at + min(50 * k, 1100))
    assert bench.read(0x6064, signed=True) == pytest.approx(at + 1000, abs=1)
    assert bench.read(0x6041) & 0x0800


def test_brake_release(bench):
    bench.start()
    for word in (0x06, 0x07, 0x0F, 0x0F):
        bench.cycle(word, 0)
    assert bench.state() == 0x27
    for _ in range(5):
        bench.cycle(0x0F, 50)
    assert bench.read(0x6064, signed=True) == 0
    for _ in range(60):
        bench.cycle(0x0F, 50)
    assert bench.read(0x6064, signed=True) == 50


def test_short_rpdo_and_sync_without_counter_are_reported_once(enabled):
    bench, at = enabled
    bench.send(0x201, b"\x0f\x00\x00")
    bench.send(0x201, b"\x0f\x00\x00")
    bench.send(0x080, b"")
    bench.send(0x080, b"")
    frames = bench.run(1 * MS)
    assert [entry[1] for entry in bench.emergencies(frames)] == [0x8210, 0x8240]
    frames = bench.cycle(0x0F, at) + bench.cycle(0x0F, at)
    assert [entry[1:] for entry in bench.emergencies(frames)] == [(0, 0x11), (0, 0x00)]


def test_history_keeps_the_newest_eight(enabled):
    bench, at = enabled
    for _ in range(9):
        fault(bench, at)
        for word in (0x00, 0x80, 0x80, 0x06, 0x07, 0x0F, 0x0F):
            bench.cycle(word, at)
    assert bench.read(0x1003, 0) == 8
    assert bench.read(0x1003, 8) == 0xFF01
    assert bench.write(0x1003, 0, 5, 1) == 0x06090030
    assert bench.write(0x1003, 0, 0, 1) == 0
    assert bench.read(0x1003, 0) == 0


def test_a_sync_that_comes_late_and_a_skipped_one_after_it_are_no_other_velocity(enabled):
    """As after a pause of the controller between its clock and its SYNC, at the highest speed."""
    bench, at = enabled
    step = int(0.95 * 30 / 360 * 2**20 * 0.002)
    last = moving(bench, at, step=step)
    bench.run(23 * MS // 10)
    bench.cycle(0x0F, last + step)
    bench.run(-bench.now % MS)
    for k in range(3, 40):
        bench.cycle(0x0F, last + step * k, skip=1 if k == 3 else 0)
    assert bench.state() == 0x27
    assert velocity(bench) == pytest.approx(500.0 * step, rel=0.01)
