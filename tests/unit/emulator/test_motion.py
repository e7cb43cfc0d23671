"""Demand, axis and motor: pure motion."""

import dataclasses

import numpy as np
import pytest

from axisync_emulator.drive.axis_model import BANDWIDTH_HZ, DAMPING, LAG_S, AxisModel
from axisync_emulator.drive.demand import Demand
from axisync_emulator.drive.motor import Motor
from axisync_emulator.drive.noise import noise
from axisync_emulator.drive.specification import DriveSpecification

MS = 1_000_000


def test_interpolates_over_one_period():
    demand = Demand(100.0)
    demand.follow(300.0, 10 * MS, 2 * MS, hold=False)
    assert [demand.at(t * MS) for t in (10, 11, 12)] == pytest.approx([100, 200, 300])
    assert demand.velocity_at(11 * MS) == pytest.approx(100_000)


def test_goes_on_at_constant_velocity():
    demand = Demand(0.0)
    demand.follow(100.0, 0, 2 * MS, hold=False)
    assert demand.at(12 * MS) == pytest.approx(600)
    assert demand.velocity_at(12 * MS) == pytest.approx(50_000)


def test_or_holds_the_target():
    demand = Demand(0.0)
    demand.follow(100.0, 0, 2 * MS, hold=True)
    assert demand.at(12 * MS) == pytest.approx(100)
    assert demand.velocity_at(12 * MS) == 0.0


def test_next_target_from_where_it_is():
    demand = Demand(0.0)
    demand.follow(100.0, 0, 2 * MS, hold=False)
    demand.follow(200.0, 3 * MS, 2 * MS, hold=False)
    assert demand.at(3 * MS) == pytest.approx(150)
    assert demand.at(5 * MS) == pytest.approx(200)


@pytest.mark.parametrize("sign", [1, -1])
def test_ramp_ends_at_v_squared_over_2a(sign: int):
    demand = Demand(0.0)
    demand.follow(sign * 100.0, 0, 2 * MS, hold=False)
    end = demand.ramp(2 * MS, 250_000.0)
    assert end == 2 * MS + 200 * MS
    assert demand.at(end) == pytest.approx(sign * (100 + 50_000**2 / 500_000))
    assert demand.at(end + 999 * MS) == demand.at(end)
    assert demand.velocity_at(end) == 0.0
    assert demand.velocity_at(2 * MS + 100 * MS) == pytest.approx(sign * 25_000)


def _integrate(position: float, velocity: float, demand, duration: float, steps: int = 20_000) -> tuple[float, float]:
    """Runge-Kutta, as an independent solution."""
    omega = 2 * np.pi * BANDWIDTH_HZ
    h = duration / steps
    state = np.array([position, velocity])

    def slope(t: float, s: np.ndarray) -> np.ndarray:
        return np.array([s[1], omega**2 * (demand(t) - s[0]) - 2 * DAMPING * omega * s[1]])

    for i in range(steps):
        t = i * h
        a = slope(t, state)
        b = slope(t + h / 2, state + h / 2 * a)
        c = slope(t + h / 2, state + h / 2 * b)
        d = slope(t + h, state + h * c)
        state = state + h / 6 * (a + 2 * b + 2 * c + d)
    return float(state[0]), float(state[1])


def test_step_solves_the_differential_equation():
    model = AxisModel(10.0)
    model.velocity = -300.0
    model.step(2 * MS, 20.0, 50.0)
    expected = _integrate(10.0, -300.0, lambda t: 20.0 + 15_000.0 * t, 2e-3, 400)
    assert (model.position, model.velocity) == pytest.approx(expected, rel=1e-9)


def test_steps_can_be_cut_anywhere():
    whole, cut = AxisModel(0.0), AxisModel(0.0)
    whole.step(10 * MS, 0.0, 1000.0)
    for i in range(10):
        cut.step(MS, 100.0 * i, 100.0 * (i + 1))
    assert cut.position == pytest.approx(whole.position)
    assert cut.velocity == pytest.approx(whole.velocity)


def test_constant_velocity_is_followed_with_the_lag():
    model = AxisModel(0.0)
    model.step(10_000 * MS, 0.0, 1e6)
    assert model.position == pytest.approx(1e6 - LAG_S * 1e5)
    assert model.velocity == pytest.approx(1e5)


SPECIFICATION = DriveSpecification(
    name="a", node_id=1, vendor_id=1, product_code=1, serial=1, start=1000.0, speed_limit=130_000.0,
    enable_window=5825.0, deceleration=262_144, rated_acceleration=1_048_576, brake_deceleration=2_621_440.0,
    brake_release_ns=60 * MS, hold_on_missed=False, counts_per_turn=1 << 20, limit_switches=(-5e5, 5e5),
    home_switch=0.0,
)  # fmt: skip
NUMBERS = {(0x2002, 1): 20, (0x2002, 2): 5, (0x2002, 3): 1_048_576, (0x6072, 0): 3000, (0x6073, 0): 3000}


def motor_with(brake_release_ns: int = 0, **numbers: int) -> Motor:
    """A motor under torque, with these values of 0x2002:4 (`noise`) or 0x6072 (`limit`)."""
    motor = Motor(dataclasses.replace(SPECIFICATION, brake_release_ns=brake_release_ns))
    values = {**NUMBERS, (0x2002, 4): numbers.get("noise", 0), (0x6072, 0): numbers.get("limit", 3000)}
    motor.configure(lambda index, sub: values[index, sub])
    motor.switch_on(0)
    return motor


def accelerate(motor: Motor, acceleration: float, cycles: int) -> int:
    """Follows a demand of this acceleration from rest; the time at its end."""
    for k in range(cycles):
        reach = 0.002 * (k + 1)
        motor.follow(1000.0 + 0.5 * acceleration * reach**2, 2 * k * MS, 2 * MS, hold=False)
    return 2 * cycles * MS


def test_nothing_moves_before_the_brake_is_released():
    motor = Motor(SPECIFICATION)
    motor.switch_on(0)
    motor.demand.follow(1100.0, 0, 2 * MS, hold=True)
    assert motor.position(60 * MS) == 1000
    assert motor.position(160 * MS) == 1100


def test_brake_stops_the_axis_and_holds_it():
    motor = Motor(dataclasses.replace(SPECIFICATION, brake_release_ns=0))
    motor.switch_on(0)
    motor.follow(1100.0, 0, 2 * MS, hold=False)
    motor.advance(200 * MS)
    moving = motor.position(200 * MS)
    motor.switch_off(200 * MS)
    stopped = motor.position(300 * MS)
    assert stopped - moving == pytest.approx(50_000**2 / (2 * 2_621_440), abs=2)
    assert motor.position(3000 * MS) == stopped
    assert motor.velocity(3000 * MS) == 0
    assert motor.torque(3000 * MS) == 0


def test_a_long_wait_costs_one_step(monkeypatch: pytest.MonkeyPatch):
    motor = Motor(dataclasses.replace(SPECIFICATION, brake_release_ns=0))
    motor.switch_on(0)
    steps = []
    original = AxisModel.step
    monkeypatch.setattr(AxisModel, "step", lambda self, *a: (steps.append(a), original(self, *a))[1])
    assert motor.position(86_400 * 1000 * MS) == 1000
    assert len(steps) == 1


def test_torque_is_that_of_acceleration_and_friction():
    motor = motor_with()
    now = accelerate(motor, 262_144.0, 200)  # a quarter of what rated torque gives
    assert motor.torque(now) == pytest.approx(250 + 20 + 5 * motor.velocity(now) / 100_000, abs=15)


def test_within_the_torque_limit_it_changes_nothing():
    free, limited = motor_with(limit=3000), motor_with(limit=300)
    assert free.position(accelerate(free, 262_144.0, 100)) == limited.position(accelerate(limited, 262_144.0, 100))


def test_the_torque_limit_bounds_acceleration():
    motor = motor_with(limit=270)  # 20 of it are friction, which grows with the speed
    now = accelerate(motor, 524_288.0, 100)
    assert motor.torque(now) == 270
    reached = motor.velocity(now)
    assert 0.85 * 262_144 * 0.2 < reached < 262_144 * 0.2
    assert motor.demand_position(now) - motor.position(now) > 4000


def test_it_catches_up_once_the_limit_allows():
    motor = motor_with(limit=500)
    motor.demand.follow(1100.0, 0, 2 * MS, hold=True)
    assert motor.torque(1 * MS) == 500
    assert motor.position(1000 * MS) == 1100
    assert abs(motor.torque(1000 * MS)) <= 1


def test_a_jammed_axis_stays_where_it_is_at_full_torque():
    motor = motor_with()
    now = accelerate(motor, 262_144.0, 50)
    stuck = motor.position(now)
    motor.jammed = True
    for k in range(50, 100):
        motor.follow(stuck + 100.0 * (k - 49), 2 * k * MS, 2 * MS, hold=False)
    assert motor.position(200 * MS) == stuck
    assert motor.torque(200 * MS) == 3000


def test_noise_is_small_repeatable_and_silent_at_rest():
    quiet, noisy = motor_with(noise=0), motor_with(noise=40)
    accelerate(quiet, 262_144.0, 50)
    accelerate(noisy, 262_144.0, 50)
    times = [100 * MS + 7919 * k for k in range(200)]
    differences = [noisy.position(t) - quiet.position(t) for t in times]
    assert {-1, 0, 1} == set(differences)
    again = motor_with(noise=40)
    accelerate(again, 262_144.0, 50)
    quiet = motor_with(noise=0)
    accelerate(quiet, 262_144.0, 50)
    assert [again.position(t) - quiet.position(t) for t in times] == differences
    still = motor_with(noise=40)
    assert {still.position(t) for t in times} == {1000}


def test_noise_is_evenly_distributed():
    values = [noise(5, 2 * MS * k) for k in range(20_000)]
    assert min(values) >= -1.0
    assert max(values) < 1.0
    assert np.mean(values) == pytest.approx(0.0, abs=0.02)
    assert np.std(values) == pytest.approx(1 / 3**0.5, abs=0.02)
    assert abs(np.corrcoef(values[1:], values[:-1])[0, 1]) < 0.03


def test_a_new_reference_moves_the_numbers_not_the_axis():
    motor = motor_with()
    motor.refer(-300.0, 0)
    assert motor.position(10 * MS) == 700
    assert motor.demand_position(10 * MS) == 700
    assert motor.mechanical(10 * MS) == 1000
    motor.switch_off(10 * MS)
    assert motor.position(20 * MS) == 700


@pytest.mark.parametrize("sign", [1, -1])
def test_cruise_accelerates_and_keeps_its_speed(sign: int):
    demand = Demand(0.0)
    end = demand.cruise(0, sign * 1000.0, 10_000.0)
    assert end == 100 * MS
    assert not demand.at_rest(0) or demand.velocity_at(1) != 0
    assert demand.at(end) == pytest.approx(sign * 50)
    assert demand.at(end + 1000 * MS) == pytest.approx(sign * 1050)
    assert demand.velocity_at(end + MS) == sign * 1000
    demand.cruise(end + 1000 * MS, sign * -1000.0, 10_000.0)
    assert demand.velocity_at(end + 1100 * MS) == pytest.approx(0.0)
    assert demand.velocity_at(end + 1300 * MS) == sign * -1000
    rest = demand.ramp(end + 1300 * MS, 10_000.0)
    assert demand.at_rest(rest)


@pytest.mark.parametrize("missing", [1, 2, 4])
def test_gaps_that_come_again_and_again_do_not_add_up(missing: int) -> None:
    """Each gap's error is that of one extrapolation: a/2 (n T)^2 and the lag of the targets' mean velocity."""
    period_ns, acceleration, step = 2_000_000, 116_500.0, missing + 1
    demand, worst = Demand(0.0), 0.0
    for cycle in range(0, 600, step):
        now = cycle * period_ns
        reach = (cycle + 1) * period_ns * 1e-9
        if cycle:
            worst = max(worst, abs(demand.at(now) - 0.5 * acceleration * (now * 1e-9) ** 2))
        demand.follow(0.5 * acceleration * reach**2, now, period_ns, hold=False)
    span = step * period_ns * 1e-9
    assert worst <= 1.5 * acceleration * span**2


def test_a_missed_target_is_passed_at_the_targets_own_velocity() -> None:
    period_ns = 2_000_000
    demand = Demand(0.0)
    for cycle in range(4):
        demand.follow(100.0 * (cycle + 1), cycle * period_ns, period_ns, hold=False)
    demand.follow(430.0, 3 * period_ns, period_ns, hold=False)
    assert demand.at(4 * period_ns) == pytest.approx(430.0)
    assert demand.at(6 * period_ns) == pytest.approx(430.0 + 2 * 30.0)
    assert demand.linear_until(3 * period_ns, 6 * period_ns) == 4 * period_ns
