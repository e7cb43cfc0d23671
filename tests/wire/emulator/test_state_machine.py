"""CiA 402-2's state machine and option codes through frames: every state with every command, every option code."""

import pytest

MS = 1_000_000
SLOW_DOWN, QUICK_STOP_RAMP = 100_000, 262_144
DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP, REACTION, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x0F, 0x08
SHUTDOWN, SWITCH_ON, ENABLE, NO_VOLTAGE, STOP, RESET = 0x06, 0x07, 0x0F, 0x00, 0x02, 0x80

# state -> where each command leads (CiA 402-2, 'Finite state automaton'), at rest
LEADS = {
    DISABLED: {SHUTDOWN: READY},
    READY: {SWITCH_ON: SWITCHED_ON, ENABLE: ENABLED, NO_VOLTAGE: DISABLED, STOP: DISABLED},
    SWITCHED_ON: {SHUTDOWN: READY, ENABLE: ENABLED, NO_VOLTAGE: DISABLED, STOP: DISABLED},
    ENABLED: {SHUTDOWN: READY, SWITCH_ON: SWITCHED_ON, NO_VOLTAGE: DISABLED, STOP: QUICK_STOP},
    QUICK_STOP: {ENABLE: ENABLED, NO_VOLTAGE: DISABLED},
    FAULT: {RESET: DISABLED},
}
WAY = {
    DISABLED: (), READY: (0x06,), SWITCHED_ON: (0x06, 0x07), ENABLED: (0x06, 0x07, 0x0F),
    QUICK_STOP: (0x06, 0x07, 0x0F, 0x02), FAULT: (0x06, 0x07, 0x0F),
}  # fmt: skip


def bring_to(bench, state: int) -> int:
    """Brings the drive, with 0x605A = 6, to this state; its position."""
    assert bench.write(0x605A, 0, 6, 2) == 0
    bench.start()
    for word in WAY[state]:
        bench.cycle(word, 0)
    if WAY[state]:
        bench.cycle(WAY[state][-1], 0)
    if state == FAULT:
        bench.inject("emergency", code=0x2310)
        for _ in range(3):
            bench.cycle(0x0F, 0)
    assert now_in(bench) == state
    return 0


def now_in(bench) -> int:
    return bench.drive.profile.statusword(bench.now) & 0x6F


@pytest.mark.parametrize("command", [SHUTDOWN, SWITCH_ON, ENABLE, NO_VOLTAGE, STOP, RESET])
@pytest.mark.parametrize("state", LEADS)
def test_every_command_in_every_state(bench, state: int, command: int):
    bring_to(bench, state)
    for _ in range(4):
        bench.cycle(command, 0)
    assert now_in(bench) == LEADS[state].get(command, state)


def moving(bench, at: int) -> int:
    for k in range(1, 61):
        bench.cycle(0x0F, at + 100 * k)
    return at + 6000


def slowing(bench) -> float | None:
    """Counts/s^2 at which the demand slows, None where there is no torque any more."""
    motor = bench.drive.motor
    if not motor.torque_on:
        return None
    since = motor.demand.since
    return (motor.demand.velocity_at(since) - motor.demand.velocity_at(since + MS)) * 1e3


def settle(bench, word: int, target: int) -> int:
    for _ in range(300):
        bench.cycle(word, target)
    return now_in(bench)


def prepare(bench, index: int, code: int) -> int:
    assert bench.write(index, 0, code, 2) == 0
    assert bench.write(0x6084, 0, SLOW_DOWN, 4) == 0
    bench.start()
    return moving(bench, bench.enable())


@pytest.mark.parametrize(("code", "ramp", "end"), [
    (0, None, DISABLED), (1, SLOW_DOWN, DISABLED), (2, QUICK_STOP_RAMP, DISABLED), (3, QUICK_STOP_RAMP, DISABLED),
    (5, SLOW_DOWN, QUICK_STOP), (6, QUICK_STOP_RAMP, QUICK_STOP), (7, QUICK_STOP_RAMP, QUICK_STOP),
])  # fmt: skip
def test_quick_stop_option_code(bench, code: int, ramp: float | None, end: int):
    last = prepare(bench, 0x605A, code)
    bench.cycle(STOP, last + 100)
    bench.cycle(STOP, last + 100)
    assert slowing(bench) == (pytest.approx(ramp, rel=1e-3) if ramp else None)
    assert now_in(bench) == (QUICK_STOP if ramp else DISABLED)
    assert settle(bench, STOP, last) == end
    assert bench.drive.motor.torque_on == (end == QUICK_STOP)


@pytest.mark.parametrize(("index", "command", "end"), [(0x605B, SHUTDOWN, READY), (0x605C, SWITCH_ON, SWITCHED_ON)])
@pytest.mark.parametrize(("code", "ramp"), [(0, None), (1, SLOW_DOWN)])
def test_shutdown_and_disable_operation_option_code(bench, index: int, command: int, end: int, code: int, ramp):
    last = prepare(bench, index, code)
    bench.cycle(command, last + 100)
    bench.cycle(command, last + 100)
    assert slowing(bench) == (pytest.approx(ramp, rel=1e-3) if ramp else None)
    assert now_in(bench) == (ENABLED if ramp else end)
    assert settle(bench, command, last) == end


@pytest.mark.parametrize(("code", "ramp"), [(1, SLOW_DOWN), (2, QUICK_STOP_RAMP)])
def test_halt_option_code(bench, code: int, ramp: float):
    last = prepare(bench, 0x605D, code)
    bench.cycle(0x10F, last + 100)
    bench.cycle(0x10F, last + 100)
    assert slowing(bench) == pytest.approx(ramp, rel=1e-3)
    assert settle(bench, 0x10F, last) == ENABLED
    assert bench.drive.profile.statusword(bench.now) & 0x0400


@pytest.mark.parametrize(("code", "ramp"), [(0, None), (1, SLOW_DOWN), (2, QUICK_STOP_RAMP)])
def test_fault_reaction_option_code(bench, code: int, ramp: float | None):
    last = prepare(bench, 0x605E, code)
    bench.inject("emergency", code=0x2310)
    bench.cycle(0x0F, last + 100)
    assert slowing(bench) == (pytest.approx(ramp, rel=1e-3) if ramp else None)
    assert now_in(bench) == (REACTION if ramp else FAULT)
    assert settle(bench, 0x0F, last) == FAULT


@pytest.mark.parametrize(("code", "state"), [(0, ENABLED), (1, REACTION), (2, DISABLED), (3, QUICK_STOP)])
def test_abort_connection_option_code(bench, code: int, state: int):
    prepare(bench, 0x6007, code)
    bench.send(0x000, b"\x80\x01")
    bench.run(MS)
    assert now_in(bench) == state


@pytest.mark.parametrize(("index", "codes"), [
    (0x605A, (4, 8, -1)), (0x605B, (2, -1)), (0x605C, (2,)), (0x605D, (0, 3)), (0x605E, (3, -1)), (0x6007, (4, -1)),
])  # fmt: skip
def test_option_codes_that_it_does_not_have(bench, index: int, codes: tuple[int, ...]):
    for code in codes:
        assert bench.write(index, 0, code, 2) == 0x06090030


def test_enable_again_out_of_quick_stop_waits_for_a_target_near_the_axis(bench):
    last = prepare(bench, 0x605A, 6)
    settle(bench, STOP, last)
    stopped = round(bench.drive.motor.demand.at(bench.now))
    assert abs(stopped - last) > 1000
    for _ in range(5):
        bench.cycle(0x0F, stopped + 20_000)
    assert now_in(bench) == ENABLED
    assert not bench.drive.profile.statusword(bench.now) & 0x1000
    assert round(bench.drive.motor.demand.at(bench.now)) == stopped
    for _ in range(5):
        bench.cycle(0x0F, stopped)
    assert bench.drive.profile.statusword(bench.now) & 0x1000
