"""The drive profile: state machine, stops, modes of operation (CiA 402-2)."""

from collections.abc import Callable

from axisync_emulator.drive.csp import CyclicPosition
from axisync_emulator.drive.emergency import DISABLING, Emergencies, ErrorCode
from axisync_emulator.drive.homing import Homing
from axisync_emulator.drive.inputs import Inputs
from axisync_emulator.drive.motor import Motor
from axisync_emulator.drive.options import OPTIONS, STAYS_IN_QUICK_STOP, Abort, Mode, Ramp
from axisync_emulator.drive.specification import DriveSpecification
from axisync_emulator.drive.states import (
    HALT_BIT,
    POWERED,
    TRANSITIONS,
    Command,
    State,
    Stop,
    Transition,
    command_of,
)
from axisync_emulator.timers import Timer

_VOLTAGE, _WARNING, _REMOTE, _AT_REST, _LIMIT = 0x0010, 0x0080, 0x0200, 0x0400, 0x0800
_FOLLOWS, _FOLLOWING_ERROR = 0x1000, 0x2000
_STEADY = _VOLTAGE | _REMOTE
_OPTION_OF = {Stop.SHUTDOWN: 0x605B, Stop.DISABLE_OPERATION: 0x605C, Stop.QUICK_STOP: 0x605A, Stop.FAULT: 0x605E}


class Profile:
    """What the drive does with controlword and target.

    Attributes:
        controlword: as written.
        mode: 0x6060 and, since changes take effect at once, 0x6061.
        warning: something outside of the profile is not as it should be.
        on_fault: told the code of a fault that the profile detects itself.
        on_reset: told that a fault has been reset.
    """

    def __init__(self, specification: DriveSpecification, motor: Motor, inputs: Inputs, emergencies: Emergencies,
                 number: Callable[[int, int], int], timer: Callable[[Callable[[int], None]], Timer],
                 on_fault: Callable[[ErrorCode, int], None], on_reset: Callable[[int], None]) -> None:  # fmt: skip
        self._motor = motor
        self._emergencies = emergencies
        self._number = number
        self._on_fault = on_fault
        self._on_reset = on_reset
        self._ramp_end = timer(self._finish_stop)
        self.csp = CyclicPosition(specification, motor)
        self.homing = Homing(motor, inputs, number, timer)
        self.warning = False
        self.configure()
        self.restart(0)

    def configure(self) -> None:
        """Takes over 0x2002, 0x6065, 0x6066, 0x6072, 0x6073, and what the modes need."""
        number = self._number
        self._motor.configure(number)
        self.csp.configure(number)
        window = number(0x6065, 0)
        self._window = None if window == 0xFFFFFFFF else window
        self._window_ns = number(0x6066, 0) * 1_000_000

    def restart(self, now: int) -> None:
        """As after power-on: torque off, no command seen."""
        self._motor.switch_off(now)
        self._ramp_end.cancel()
        self.csp.restart()
        self.homing.leave()
        self.state = State.SWITCH_ON_DISABLED
        self.controlword = 0
        self.mode = Mode.NONE
        self._previous = 0
        self._settled = -1
        self._pending: State | None = None
        self._halted = False
        self._refused = False
        self._outside_since: int | None = None

    @property
    def enabled(self) -> bool:
        """In operation enabled, and not on the way out of it."""
        return self.state is State.OPERATION_ENABLED and self._pending is None

    def statusword(self, now: int) -> int:
        """0x6041."""
        word = self.state | _STEADY
        motor = self._motor
        if self._refused or self.warning:
            word |= _WARNING
        if self.csp.limited:
            word |= _LIMIT
        if self.mode is Mode.HOMING:
            return word | self.homing.status(now)
        if not motor.torque_on or motor.demand.at_rest(now):
            word |= _AT_REST
        if self._outside_since is not None:
            word |= _FOLLOWING_ERROR
        if self.mode is Mode.CYCLIC_SYNCHRONOUS_POSITION and self.enabled and not (self._halted or self.csp.waiting):
            word |= _FOLLOWS
        return word

    # Commands.

    def control(self, now: int) -> None:
        """Carries out what the controlword commands, as often as it is received: a refused enable is tried again."""
        word = self.controlword
        if word == self._settled:
            return
        command = command_of(word, self._previous)
        self._previous = word
        self._settled = word
        self._refused = False
        while command is not None and self._carry_out(command, now):
            pass
        if self.mode is Mode.HOMING and self.enabled:
            self.homing.control(word, bool(word & HALT_BIT), now)

    def _carry_out(self, command: Command, now: int) -> bool:
        """Takes one transition; whether another may follow."""
        row = TRANSITIONS.get((self.state, command))
        if row is None or (self._pending is not None and not self._overrides_stop(command)):
            return False
        if not self._allowed(row, now):
            return False
        before = self.state
        self._leave(row, now)
        return self.state is not before

    def _allowed(self, row: Transition, now: int) -> bool:
        if row.number == 4 and not self._may_enable(now):
            self._settled = -1
            self._refused = True
            return False
        if row.number == 2:
            return ErrorCode.SAFE_TORQUE_OFF not in self._emergencies.active
        if row.number == 15:
            return self._emergencies.active.isdisjoint(DISABLING)
        if row.number == 16:
            return self._pending is None and self._number(0x605A, 0) in STAYS_IN_QUICK_STOP
        return True

    def _overrides_stop(self, command: Command) -> bool:
        if self.state is State.OPERATION_ENABLED:
            return command in (Command.DISABLE_VOLTAGE, Command.QUICK_STOP)
        return command is Command.DISABLE_VOLTAGE

    def _leave(self, row: Transition, now: int) -> None:
        if row.stop is Stop.QUICK_STOP:
            self.quick_stop(now)
        elif row.stop is Stop.NONE:
            self._enter(row.target, now)
        elif row.stop is Stop.AT_ONCE:
            self._stop(Ramp.COAST, row.target, now)
        else:
            self._stop(self._option(row.stop), row.target, now)

    def _option(self, stop: Stop) -> Ramp:
        index = _OPTION_OF[stop]
        return OPTIONS[index].get(self._number(index, 0), Ramp.QUICK_STOP)

    def _may_enable(self, now: int) -> bool:
        """The mode is set, nothing is wrong that lasts, and the first target is where the axis is."""
        if self.mode is Mode.NONE or not self._emergencies.active.isdisjoint(DISABLING):
            return False
        return self.mode is Mode.HOMING or self.csp.near(now)

    def _enter(self, state: State, now: int) -> None:
        if state is State.OPERATION_ENABLED:
            self._emergencies.code = 0
            self.csp.begin(waiting=self._motor.torque_on)
            if not self._motor.torque_on:
                self._motor.switch_on(now)
        elif state not in POWERED:
            self._motor.switch_off(now)
            self._outside_since = None
            self.csp.limited = False
        reset = state is State.SWITCH_ON_DISABLED and self.state is State.FAULT
        self.state = state
        self._pending = None
        self._halted = False
        self._settled = -1 if state is not State.OPERATION_ENABLED else self.controlword
        self._ramp_end.cancel()
        if reset:
            self._on_reset(now)

    # Stops.

    def quick_stop(self, now: int) -> None:
        """Transition 11, commanded or as the reaction to a lost connection."""
        if self.state is not State.OPERATION_ENABLED:
            return
        stays = self._number(0x605A, 0) in STAYS_IN_QUICK_STOP
        self.state = State.QUICK_STOP_ACTIVE
        then = State.QUICK_STOP_ACTIVE if stays else State.SWITCH_ON_DISABLED
        self._stop(self._option(Stop.QUICK_STOP), then, now)

    def fault(self, now: int) -> None:
        """Transitions 13 and 14; the caller reports the error."""
        if self.state in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            return
        if self.state not in POWERED:
            self._enter(State.FAULT, now)
            return
        self.state = State.FAULT_REACTION_ACTIVE
        self._stop(self._option(Stop.FAULT), State.FAULT, now)

    def safe_torque_off(self, now: int) -> None:
        """The power stage is cut: a fault where there was torque, else only no longer ready."""
        if self.state in POWERED:
            self.state = State.FAULT_REACTION_ACTIVE
            self._stop(Ramp.COAST, State.FAULT, now)
        elif self.state is not State.FAULT:
            self._enter(State.SWITCH_ON_DISABLED, now)

    def abort_connection(self, now: int) -> None:
        """What 0x6007 wants when the master or the network is lost."""
        if self.state is not State.OPERATION_ENABLED:
            return
        code = self._number(0x6007, 0)
        if code == Abort.QUICK_STOP:
            self.quick_stop(now)
        elif code == Abort.DISABLE_VOLTAGE:
            self._stop(Ramp.COAST, State.SWITCH_ON_DISABLED, now)
        elif code == Abort.FAULT:
            self.fault(now)

    def _stop(self, ramp: Ramp, then: State, now: int) -> None:
        self._pending = then
        self._settled = -1
        self.homing.leave()
        if ramp is Ramp.COAST:
            self._finish_stop(now)
            return
        end = self._motor.ramp(now, self._deceleration(ramp))
        if end > now:
            self._ramp_end.set(end)
        else:
            self._finish_stop(now)

    def _deceleration(self, ramp: Ramp) -> float:
        return max(1.0, float(self._number(0x6084 if ramp is Ramp.SLOW_DOWN else 0x6085, 0)))

    def _finish_stop(self, now: int) -> None:
        if self._pending is not None:
            self._enter(self._pending, now)

    # Motion.

    def set_mode(self, mode: int, now: int) -> None:
        """0x6060. Changing it in motion stops the axis; targets count again once one is where the axis is."""
        if mode != self.mode:
            if self.enabled:
                self._motor.ramp(now, self._deceleration(Ramp.QUICK_STOP))
                self.csp.begin(waiting=True)
            self.homing.leave()
        self.mode = Mode(mode)
        self._settled = -1

    def follow(self, now: int, cycles: int | None = None) -> None:
        """Sets out for the target, where the mode has one, `cycles` SYNCs after the last; None: it came without one."""
        if self.mode is not Mode.CYCLIC_SYNCHRONOUS_POSITION or not self.enabled or self._halt(now):
            return
        if not self.csp.follow(now, cycles):
            self._on_fault(ErrorCode.IMPLAUSIBLE_TARGET, now)

    def _halt(self, now: int) -> bool:
        if self.controlword & HALT_BIT:
            if not self._halted:
                self._halted = True
                self._motor.ramp(now, self._deceleration(OPTIONS[0x605D].get(self._number(0x605D, 0), Ramp.QUICK_STOP)))
            return True
        self._halted = False
        return False

    def watch_following_error(self, now: int) -> None:
        """Fault where the axis is outside the window 0x6065 for longer than 0x6066."""
        if self._window is None or self.state is not State.OPERATION_ENABLED or self._pending is not None:
            return
        if abs(self._motor.following_error(now)) <= self._window:
            self._outside_since = None
        elif self._outside_since is None:
            self._outside_since = now
        if self._outside_since is not None and now - self._outside_since >= self._window_ns:
            self._on_fault(ErrorCode.FOLLOWING_ERROR, now)
