"""A drive that does at once what it is told: for tests of decisions, which need no bus.

In homing mode it turns by 5 counts a tick, and finds its home where its counts are `home_at`.
"""

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import DriveState, NmtState
from axisync_service.canopen.pdo import make_rpdo1
from axisync_service.drives.bring_up import Phase
from axisync_service.drives.cia402 import Controlword
from axisync_service.drives.link import DriveLink
from axisync_service.mapper.counts import wrap_int32
from axisync_service.motion_controller.demand import Inputs
from axisync_service.motion_controller.step import Core
from support.sdo_server import SdoServer

_STATUSWORD = {
    DriveState.SWITCH_ON_DISABLED: 0x0250,
    DriveState.READY_TO_SWITCH_ON: 0x0231,
    DriveState.SWITCHED_ON: 0x0233,
    DriveState.OPERATION_ENABLED: 0x1237,
    DriveState.QUICK_STOP_ACTIVE: 0x0217,
    DriveState.FAULT: 0x0218,
}
_UP = {
    (DriveState.SWITCH_ON_DISABLED, Controlword.SHUTDOWN): DriveState.READY_TO_SWITCH_ON,
    (DriveState.READY_TO_SWITCH_ON, Controlword.SWITCH_ON): DriveState.SWITCHED_ON,
    (DriveState.SWITCHED_ON, Controlword.ENABLE_OPERATION): DriveState.OPERATION_ENABLED,
    (DriveState.OPERATION_ENABLED, Controlword.SHUTDOWN): DriveState.READY_TO_SWITCH_ON,
    (DriveState.OPERATION_ENABLED, Controlword.QUICK_STOP): DriveState.SWITCH_ON_DISABLED,
}


HOMING_STEP = 5
_HALT, _START = 0x100, 0x10
_REACHED, _ATTAINED, _HOMING_ERROR, _FOLLOWS = 0x0400, 0x1000, 0x2000, 0x1000


class IdealDrive:
    """Answers one `DriveLink`.

    Attributes:
        silent, stuck: sends nothing; does not follow its target.
        home_at: counts at which it finds its home, from then on 0. homing_fails: instead it reports a homing error.
    """

    def __init__(self, link: DriveLink, counts: int) -> None:
        self.link, self.counts = link, counts
        self.state = DriveState.SWITCH_ON_DISABLED
        self.silent = False
        self.stuck = False
        self._reset_bit = False
        self.server = SdoServer(link.axis)
        self.home_at = counts
        self.homing_fails = False
        self._homed = False
        link.bring_up.phase, link.bring_up.serial = Phase.READY, 77
        self.server.values[0x6060, 0] = self.server.values[0x6061, 0] = b"\x08"

    def tick(self, controlword: int, target: int, now_ns: int) -> None:
        """Takes an RPDO and answers with a TPDO and a heartbeat."""
        reset = bool(controlword & 0x80)
        if self.state is DriveState.FAULT and reset and not self._reset_bit:
            self.state = DriveState.SWITCH_ON_DISABLED
        self._reset_bit = reset
        if controlword == Controlword.DISABLE_VOLTAGE and self.state is not DriveState.FAULT:
            self.state = DriveState.SWITCH_ON_DISABLED
        else:
            self.state = _UP.get((self.state, Controlword(controlword)), self.state)
        word = _STATUSWORD[self.state]
        if self.state is DriveState.OPERATION_ENABLED and self.server.values[0x6060, 0] == b"\x06":
            word = word & ~_FOLLOWS | self._seek_home(controlword)
        elif self.state is DriveState.OPERATION_ENABLED and not self.stuck:
            self.counts = target
        if not self.silent:
            if not self.link.bring_up.sdo.idle:
                self.server.serve(self.link.bring_up, now_ns)
                self.server.values[0x6061, 0] = self.server.values[0x6060, 0]
            self.link.on_tpdo1(make_rpdo1(word, wrap_int32(self.counts)))
            self.link.on_heartbeat(bytes((NmtState.OPERATIONAL,)), now_ns)

    def _seek_home(self, controlword: int) -> int:
        """Bits of the statusword in homing mode."""
        if controlword & _HALT or not controlword & _START:
            return _REACHED | (_ATTAINED if self._homed else 0)
        if self.homing_fails:
            return _REACHED | _HOMING_ERROR
        if not self._homed:
            left = self.home_at - self.counts
            self.counts += max(-HOMING_STEP, min(HOMING_STEP, left))
            if self.counts == self.home_at:
                self.counts, self._homed = 0, True
        return _ATTAINED | _REACHED if self._homed else 0


class Bench:
    """A core with ideal drives, run tick by tick.

    Attributes:
        events: every happening so far; replies: ref to error, or None where done.
        rows: setpoints in force at each executed tick: position, velocity, acceleration, jerk (lists).
    """

    def __init__(self, cell: Cell, core: Core) -> None:
        self.cell, self.core = cell, core
        starts = [axis.drive.start - axis.drive.offset for axis in cell.axes]
        scale = [axis.drive.counts_per_rad for axis in cell.axes]
        self.drives = [IdealDrive(d, round(q * s)) for d, q, s in zip(core.drives, starts, scale, strict=True)]
        self.tick = 0
        groups = len(cell.groups)
        self.stops, self.leases, self.epochs = [0] * groups, [2**62] * groups, [1] * groups
        self.front, self.stopping = True, False
        self.commands: list = []  # type: ignore[type-arg]
        self.events: list = []  # type: ignore[type-arg]
        self.replies: dict[int, object] = {}
        self.rows: list[tuple[list[float], ...]] = []

    @property
    def now_ns(self) -> int:
        """Time of the present tick."""
        return self.tick * self.cell.period_ns

    def run(self, ticks: int = 1, skipped: int = 0) -> None:
        """Executes `ticks` ticks, `skipped` of the grid left out before the first of them."""
        for _ in range(ticks):
            for _ in range(skipped):
                self.tick += 1
                self.core.begin_tick()
                self._record()
                self.core.advance_skipped()
            self.tick += 1
            self._execute(skipped)
            skipped = 0

    def _execute(self, skipped: int) -> None:
        core = self.core
        core.begin_tick()
        counts = core.current.counts.tolist()
        for group in core.groups:
            for axis in range(len(group.drives)):
                index = group.first + axis
                self.drives[index].tick(group.controlword(axis, self.tick), counts[index], self.now_ns)
        inputs = Inputs(
            tick=self.tick,
            now_ns=self.now_ns,
            skipped=skipped,
            stop_counts=list(self.stops),
            lease_until_ns=list(self.leases),
            lease_epochs=list(self.epochs),
            front=self.front,
            leases_needed=True,
            stopping=self.stopping,
        )
        commands, self.commands = self.commands, []
        core.step(inputs, commands)
        self._record()
        self.events += core.voice.happenings
        core.voice.happenings.clear()
        self.replies |= dict(core.voice.replies)
        core.voice.replies.clear()

    def _record(self) -> None:
        now = self.core.current
        self.rows.append(tuple(x.tolist() for x in (now.position, now.velocity, now.acceleration, now.jerk)))

    def kinds(self) -> list[str]:
        """Kinds of the events so far."""
        return [event.kind.value for event in self.events]
