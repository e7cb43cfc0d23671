"""Homing mode: statusword bits, switches, the position that is set."""

import pytest

TURN = 1 << 20
ATTAINED, REACHED, ERROR = 0x1000, 0x0400, 0x2000


def configure(bench, method: int, offset: int = 0, fast: int = 60_000, slow: int = 6_000) -> None:
    for row in (
        (0x6098, 0, method, 1), (0x607C, 0, offset, 4), (0x6099, 1, fast, 4), (0x6099, 2, slow, 4),
        (0x609A, 0, 200_000, 4), (0x6060, 0, 6, 1),
    ):  # fmt: skip
        assert bench.write(*row) == 0


def enable(bench) -> None:
    bench.start()
    for word in (0x06, 0x07, *(0x0F,) * 35):
        bench.cycle(word, 0)
    assert bench.state() == 0x27


def status(bench) -> int:
    return bench.read(0x6041) & 0x3400


def run(bench, cycles: int, word: int = 0x1F) -> int:
    """Cycles until the statusword says how homing ended; its bits."""
    bench.cycle(word, 0)
    for _ in range(cycles):
        bench.cycle(word, 0)
        if bench.drive.profile.homing.status(bench.now) not in (0,):
            break
    return status(bench)


def place(bench, counts: float) -> None:
    """The axis stands here, before it is enabled."""
    motor = bench.drive.motor
    motor._model.position = counts
    motor._braking.rest(counts, 0)


@pytest.mark.parametrize("method", [35, 37])
def test_where_it_is_becomes_the_home_offset(bench, method: int):
    place(bench, 5000.0)
    configure(bench, method, offset=-1234)
    enable(bench)
    assert status(bench) == REACHED  # not started
    assert run(bench, 60) == ATTAINED | REACHED
    assert bench.read(0x6064, signed=True) == -1234
    assert bench.read(0x6062, signed=True) == -1234


@pytest.mark.parametrize(("method", "start", "left"), [
    (19, -0.01, 1), (19, 0.01, 1), (20, -0.01, -1), (20, 0.01, -1),
    (17, -0.49, 1), (17, -0.4995, 1), (18, 0.49, -1), (18, 0.4995, -1),
])  # fmt: skip
def test_by_a_switch(bench, method: int, start: float, left: int):
    """The edge is where the position is the home offset; the axis ends just past it, on the side it went to."""
    place(bench, start * TURN)
    configure(bench, method, offset=777)
    enable(bench)
    assert run(bench, 1500) == ATTAINED | REACHED
    edge = {17: -TURN / 2, 18: TURN / 2}.get(method, 0.0)
    motor = bench.drive.motor
    assert motor.mechanical(bench.now) - edge == pytest.approx(bench.read(0x6064, signed=True) - 777, abs=1)
    past = (bench.read(0x6064, signed=True) - 777) * (left if method in (17, 18) else -left)
    assert 0 <= past <= 300  # at 6,000 counts/s it stops within 6000^2 / (2 * 200,000) = 90 counts and its lag
    assert bench.state() == 0x27


def test_progress_and_interruption(bench):
    place(bench, -0.05 * TURN)
    configure(bench, 19)
    enable(bench)
    for _ in range(50):
        bench.cycle(0x1F, 0)
    assert status(bench) == 0
    assert bench.read(0x606C, signed=True) > 0
    for _ in range(200):
        bench.cycle(0x0F, 0)  # bit 4 falls: interrupted
    assert status(bench) == REACHED
    stopped = bench.read(0x6064, signed=True)
    for _ in range(50):
        bench.cycle(0x0F, 0)
    assert bench.read(0x6064, signed=True) == pytest.approx(stopped, abs=1)
    assert run(bench, 1500) == ATTAINED | REACHED


def test_halt_pauses_a_homing(bench):
    place(bench, -0.05 * TURN)
    configure(bench, 19)
    enable(bench)
    for _ in range(50):
        bench.cycle(0x1F, 0)
    for _ in range(200):
        bench.cycle(0x11F, 0)
    assert status(bench) == REACHED
    assert abs(bench.drive.motor.velocity(bench.now)) < 50
    bench.cycle(0x1F, 0)
    bench.cycle(0x1F, 0)
    assert run(bench, 1500) == ATTAINED | REACHED


def test_a_home_switch_that_never_changes_is_an_error_at_the_limit_switch(bench):
    place(bench, 0.49 * TURN)
    configure(bench, 19)
    bench.inject("input", input="home", active=False)
    enable(bench)
    assert run(bench, 1500) in (ERROR, ERROR | REACHED)
    for _ in range(400):
        bench.cycle(0x1F, 0)
    assert status(bench) == ERROR | REACHED
    assert bench.read(0x60FD) & 0x2


def test_no_method_is_an_error(bench):
    configure(bench, 0)
    enable(bench)
    assert run(bench, 5) == ERROR | REACHED


def test_methods_that_it_does_not_have_are_refused(bench):
    for method in (1, 7, 33, -1):
        assert bench.write(0x6098, 0, method, 1) == 0x06090030


def test_no_homing_without_enable(bench):
    configure(bench, 37, offset=55)
    bench.start()
    for word in (0x06, 0x07, 0x17, 0x17, 0x17):
        bench.cycle(word, 0)
    assert bench.read(0x6064, signed=True) == 0
    assert status(bench) == REACHED


def test_a_stop_ends_a_homing_for_good(bench):
    place(bench, -0.05 * TURN)
    configure(bench, 19)
    enable(bench)
    for _ in range(50):
        bench.cycle(0x1F, 0)
    for _ in range(250):
        bench.cycle(0x02, 0)
    assert bench.state() == 0x40
    at = bench.read(0x6064, signed=True)
    for word in (0x06, 0x07, *(0x0F,) * 50):
        bench.cycle(word, 0)
    assert bench.state() == 0x27
    assert bench.read(0x6064, signed=True) == pytest.approx(at, abs=1)
    assert status(bench) == REACHED


def test_back_to_csp_the_target_starts_from_the_new_position(bench):
    configure(bench, 37, offset=100_000)
    enable(bench)
    assert run(bench, 60) == ATTAINED | REACHED
    assert bench.write(0x6060, 0, 8, 1) == 0
    for _ in range(5):
        bench.cycle(0x0F, 0)  # the old target: far away from where the axis now is
    assert bench.state() == 0x27
    assert not bench.read(0x6041) & 0x1000
    for k in range(100):
        bench.cycle(0x0F, 100_000 + 10 * k)
    assert bench.read(0x6041) & 0x1000
    assert bench.read(0x6064, signed=True) == pytest.approx(100_990, abs=150)
    assert bench.write(0x6060, 0, 6, 1) == 0
    assert bench.read(0x6041) & ATTAINED  # still referred to home


def test_inputs_follow_the_mechanics_whatever_the_reference(bench):
    assert bench.read(0x60FD) == 0x4
    configure(bench, 37, offset=-400_000)
    enable(bench)
    run(bench, 60)
    assert bench.read(0x60FD) == 0x4
    assert bench.drive.inputs.word(-TURN / 2 - 1) == 0x1
    assert bench.drive.inputs.word(TURN / 2 + 1) == 0x6
