"""Homing (CiA 402-2, 'Homing mode'): by limit switch (methods 17, 18), home switch (19, 20), where it is (35, 37)."""

from collections.abc import Callable
from enum import Enum, auto
from typing import NamedTuple

from axisync_emulator.drive.inputs import Input, Inputs
from axisync_emulator.drive.motor import Motor
from axisync_emulator.timers import Timer

START_BIT = 0x10
_REACHED, _ATTAINED, _ERROR = 0x0400, 0x1000, 0x2000
"""Statusword bits 10, 12, 13 in this mode."""
_LOOK_NS = 1_000_000
"""How often the switches are read."""
_SETTLE_NS = 20_000_000
"""From the end of the ramp until the axis rests."""


class Search(NamedTuple):
    """How a method looks for its switch.

    Attributes:
        active: direction in which the switch becomes active, 1 or -1.
        leaving: home is where the switch is left again; else where it is reached.
    """

    switch: Input
    active: int
    leaving: bool


METHODS: dict[int, Search | None] = {
    17: Search(Input.NEGATIVE_LIMIT, -1, leaving=True),
    18: Search(Input.POSITIVE_LIMIT, 1, leaving=True),
    19: Search(Input.HOME, 1, leaving=True),
    20: Search(Input.HOME, 1, leaving=False),
    35: None,
    37: None,
}


class Phase(Enum):
    """Where a homing is."""

    IDLE = auto()
    RELEASING = auto()
    """The brake opens."""
    SEEKING = auto()
    """Fast (0x6099:1), to the side of the switch where the last move begins."""
    LATCHING = auto()
    """Slowly (0x6099:2), across the switch's edge."""
    STOPPING = auto()
    """Found; slows down, then the position is set."""
    FAILING = auto()
    """Not found; slows down."""


class Homing:
    """Runs one homing at a time.

    Attributes:
        attained: the position refers to home; until the next homing or power-on.
        failed: the last homing did not find its switch.
    """

    def __init__(self, motor: Motor, inputs: Inputs, number: Callable[[int, int], int],
                 timer: Callable[[Callable[[int], None]], Timer]) -> None:  # fmt: skip
        self._motor = motor
        self._inputs = inputs
        self._number = number
        self._timer = timer(self._look)
        self._phase = Phase.IDLE
        self._search = METHODS[19]
        self._edge = 0.0
        self._asked = False
        self._halted = False
        self.attained = False
        self.failed = False

    def forget(self) -> None:
        """As after power-on."""
        self.leave()
        self.attained = self.failed = False

    def leave(self) -> None:
        """The mode or the torque has gone; what was under way is over."""
        self._phase = Phase.IDLE
        self._timer.cancel()
        self._asked = self._halted = False

    def status(self, now: int) -> int:
        """Statusword bits 10, 12 and 13 (CiA 402-2, 'Definition of the homing status')."""
        if self._phase in (Phase.FAILING, Phase.IDLE):
            resting = _REACHED if self._motor.demand.at_rest(now) else 0
            return resting | (_ERROR if self.failed else 0) | (_ATTAINED if self.attained else 0)
        return _REACHED if self._halted and self._motor.demand.at_rest(now) else 0

    def control(self, controlword: int, halt: bool, now: int) -> None:
        """Bit 4 starts by its rising edge and interrupts by falling; halt pauses."""
        asked = bool(controlword & START_BIT)
        if asked and not self._asked:
            self._start(now)
        elif self._asked and not asked and self._phase is not Phase.IDLE:
            self._stop(Phase.IDLE, now)
        self._asked = asked
        if halt != self._halted:
            self._halted = halt
            self._halt(now)

    def _start(self, now: int) -> None:
        method = self._number(0x6098, 0)
        self.attained = self.failed = False
        if method not in METHODS:
            self.failed = True
            return
        self._search = METHODS[method]
        self._phase = Phase.RELEASING
        self._timer.set(max(now, self._motor.released_at))

    def _halt(self, now: int) -> None:
        if self._phase in (Phase.SEEKING, Phase.LATCHING):
            if self._halted:
                self._motor.ramp(now, self._acceleration())
            else:
                self._move(now)
                self._timer.set(now + _LOOK_NS)

    def _look(self, now: int) -> None:
        if self._halted and self._phase not in (Phase.STOPPING, Phase.FAILING):
            return
        {
            Phase.RELEASING: self._release, Phase.SEEKING: self._seek, Phase.LATCHING: self._latch,
            Phase.STOPPING: self._finish, Phase.FAILING: self._fail,
        }[self._phase](now)  # fmt: skip

    def _release(self, now: int) -> None:
        if self._search is None:
            self._edge = self._motor.mechanical(now)
            self._stop(Phase.STOPPING, now)
            return
        self._phase = Phase.LATCHING if self._active(now) == self._search.leaving else Phase.SEEKING
        self._move(now)
        self._timer.set(now + _LOOK_NS)

    def _seek(self, now: int) -> None:
        assert self._search is not None
        if self._active(now) == self._search.leaving:
            self._phase = Phase.LATCHING
            self._move(now)
        self._watch_limits(now)

    def _latch(self, now: int) -> None:
        search = self._search
        assert search is not None
        if self._active(now) == search.leaving:
            self._watch_limits(now)
            return
        # The switch's edge latches the encoder: what this look is late does not matter.
        stuck = search.switch in self._inputs.forced
        self._edge = self._motor.mechanical(now) if stuck else self._inputs.edge(search.switch)
        self._stop(Phase.STOPPING, now)

    def _watch_limits(self, now: int) -> None:
        """Keeps looking, or gives up at the end of the travel."""
        end = Input.POSITIVE_LIMIT if self._direction() > 0 else Input.NEGATIVE_LIMIT
        assert self._search is not None
        if end is not self._search.switch and self._inputs.active(end, self._motor.mechanical(now)):
            self.failed = True
            self._stop(Phase.FAILING, now)
        else:
            self._timer.set(now + _LOOK_NS)

    def _finish(self, now: int) -> None:
        """The position at home is the home offset (0x607C)."""
        self._motor.refer(self._number(0x607C, 0) - self._edge, now)
        self._phase = Phase.IDLE
        self.attained = True

    def _fail(self, _now: int) -> None:
        self._phase = Phase.IDLE

    def _active(self, now: int) -> bool:
        assert self._search is not None
        return self._inputs.active(self._search.switch, self._motor.mechanical(now))

    def _direction(self) -> int:
        assert self._search is not None
        towards = self._search.active if self._search.leaving else -self._search.active
        return towards if self._phase is Phase.SEEKING else -towards

    def _move(self, now: int) -> None:
        speed = self._number(0x6099, 1 if self._phase is Phase.SEEKING else 2)
        self._motor.cruise(now, float(self._direction() * speed), self._acceleration())

    def _stop(self, then: Phase, now: int) -> None:
        self._phase = then
        end = self._motor.ramp(now, self._acceleration())
        if then is Phase.IDLE:
            self._timer.cancel()
        else:
            self._timer.set(max(now, end) + _SETTLE_NS)

    def _acceleration(self) -> float:
        return max(1.0, float(self._number(0x609A, 0)))
