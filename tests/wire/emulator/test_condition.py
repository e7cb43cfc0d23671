"""What a drive tells about itself: brake, torque, current, EMCY identifier and inhibit time."""

import itertools

import pytest

MS = 1_000_000


def test_the_brake_opens_after_its_release_time_and_closes_on_disable(bench):
    bench.start()
    assert bench.read(0x60FE, 1) == 1
    for word in (0x06, 0x07, 0x0F, 0x0F):
        bench.cycle(word, 0)
    assert bench.read(0x60FE, 1) == 1  # operation enabled, but not yet released
    for _ in range(35):
        bench.cycle(0x0F, 0)
    assert bench.read(0x60FE, 1) == 0
    assert bench.read(0x1002) & 2
    assert bench.write(0x60FE, 1, 1, 4) == 0  # it works the brake by itself
    assert bench.read(0x60FE, 1) == 0
    for _ in range(3):
        bench.cycle(0x06, 0)
    assert bench.read(0x60FE, 1) == 1


@pytest.mark.parametrize(("index", "limit"), [(0x6072, 100), (0x6073, 150)])
def test_max_torque_and_max_current_bound_the_axis(enabled, index: int, limit: int):
    bench, at = enabled
    assert bench.write(index, 0, limit, 2) == 0
    for k in range(60):
        bench.cycle(0x0F, at + round(0.5 * 524_288 * (0.002 * k) ** 2))  # half of what rated torque gives
    assert limit - 2 <= bench.read(0x6077, signed=True) <= limit + 2
    assert limit - 2 <= bench.read(0x6078, signed=True) <= limit + 2
    assert bench.read(0x60F4, signed=True) > 500


def test_inertia_and_friction_can_be_set(enabled):
    bench, at = enabled
    assert bench.write(0x2002, 1, 200, 2) == 0
    assert bench.write(0x2002, 2, 0, 2) == 0
    for k in range(100):
        bench.cycle(0x0F, at + 20 * k)
    assert bench.read(0x6077, signed=True) == pytest.approx(200, abs=20)


def test_max_motor_speed_bounds_what_is_plausible(enabled):
    bench, at = enabled
    assert bench.write(0x6080, 0, 1, 4) == 0  # 1 rpm, 35 counts a cycle
    for k in range(1, 20):
        bench.cycle(0x0F, at + 30 * k)
    assert bench.state() == 0x27
    frames = [frame for _ in range(3) for frame in bench.cycle(0x0F, at + 30 * 20 + 200)]
    assert [code for _, code, _ in bench.emergencies(frames)] == [0xFF01]


def test_inhibit_time_between_emergencies(enabled):
    bench, at = enabled
    assert bench.write(0x1015, 0, 50, 2) == 0  # 5 ms
    for code in (0x4210, 0x5112, 0x7305):
        bench.inject("emergency", code=code, warning=True)
    frames = [frame for _ in range(10) for frame in bench.cycle(0x0F, at)]
    told = bench.emergencies(frames)
    assert [code for _, code, _ in told] == [0x4210, 0x5112, 0x7305]
    gaps = [(b - a) / MS for (a, *_), (b, *_) in itertools.pairwise(told)]
    assert gaps == [pytest.approx(5.0, abs=0.2)] * 2  # as handed over; on the wire they wait for other frames
    assert bench.read(0x1001) == 0x09


def test_the_emergencys_identifier_is_an_object(bench):
    assert bench.read(0x1014) == 0x81
    assert bench.write(0x1014, 0, 0x91, 4) == 0x08000022  # it is valid: switch it off first
    assert bench.write(0x1014, 0, 0x20000081, 4) == 0x06090030
    assert bench.write(0x1014, 0, 0x80000081, 4) == 0
    bench.inject("emergency", code=0x4210, warning=True)
    assert [can_id for _, can_id, _ in bench.run(5 * MS)] == []
    assert bench.read(0x1003, 1) == 0x4210
    assert bench.write(0x1014, 0, 0x91, 4) == 0
    bench.inject("emergency", code=0x5112, warning=True)
    assert [can_id for _, can_id, _ in bench.run(5 * MS)] == [0x091]


def test_an_actual_position_with_noise_stays_near_the_truth(enabled):
    bench, at = enabled
    assert bench.write(0x2002, 4, 500, 2) == 0  # 5 counts
    errors = []
    for k in range(1, 101):
        bench.cycle(0x0F, at + 100 * k)
        errors.append(bench.drive.motor.position(bench.now) - bench.drive.motor.mechanical(bench.now))
    assert 3 < max(errors[20:]) <= 5.5
    assert -5.5 <= min(errors[20:]) < -3
    for _ in range(60):
        bench.cycle(0x0F, at + 10_000)
    assert bench.drive.motor.position(bench.now) == at + 10_000  # at rest there is none
