"""Homing of one drive (CiA 402-2, homing mode): into the mode, start, watch the statusword, back to csp. No IO here."""

from enum import Enum, auto

from axisync_schemas import eds
from axisync_schemas.enumerations import DriveState
from axisync_service.canopen.sdo import NO_OBJECT, NO_SUB_INDEX, SdoError
from axisync_service.drives.bring_up import object_name
from axisync_service.drives.cia402 import Controlword, Status
from axisync_service.drives.configuration import CYCLIC_SYNCHRONOUS_POSITION, HOMING_MODE, Row, homing_rows
from axisync_service.drives.link import DriveLink

MODE_TIMEOUT_NS = 1_000_000_000
HALT_TIMEOUT_NS = 3_000_000_000
SETTLE_TICKS = 5
"""Until a statusword answers the newest controlword or mode: SYNC makes it valid, the next samples, the next brings."""
_MODE, _MODE_DISPLAY = (0x6060, 0), (0x6061, 0)


class Phase(Enum):
    """Where the homing of a drive is."""

    CONFIGURE = auto()
    ENTER = auto()
    RUN = auto()
    HALT = auto()
    LEAVE = auto()
    SETTLE = auto()
    DONE = auto()


_COMMAND = {Phase.RUN: Controlword.START_HOMING, Phase.HALT: Controlword.HALT}


class DriveHoming:
    """Leads one enabled drive through its homing. `step` is called each tick.

    Attributes:
        failure: why home was not found, once `done`; None where it was.
        stuck: the drive is not back in csp: it must be switched off.
    """

    def __init__(self, drive: DriveLink) -> None:
        self.drive = drive
        self.phase = Phase.CONFIGURE
        self.failure: str | None = None
        self.stuck = False
        self._rows = list(homing_rows(drive.axis))
        self._answer: bytes | SdoError | None = None
        self._asked = False
        self._ticks = 0
        self._deadline_ns = 0
        homing = drive.axis.drive.homing
        self._timeout_ns = round(1e9 * homing.timeout_s) if homing is not None else 0

    @property
    def done(self) -> bool:
        """Over, one way or the other."""
        return self.phase is Phase.DONE

    @property
    def adopts(self) -> bool:
        """The setpoint follows the actual position: the drive does not listen to it, or must find it where it is."""
        return self.phase not in (Phase.CONFIGURE, Phase.DONE)

    @property
    def controlword(self) -> Controlword:
        """What the drive is told now."""
        return _COMMAND.get(self.phase, Controlword.ENABLE_OPERATION)

    def step(self, now_ns: int) -> None:
        """One tick on."""
        self._ticks += 1
        step = _STEPS.get(self.phase)
        if step is not None:
            step(self, now_ns)

    def abort(self, reason: str, now_ns: int) -> None:
        """Halts, and goes back to csp; `failure` is the reason."""
        if self.failure is None and not self.done:
            self.failure = reason
        if self.phase is Phase.RUN:
            self._go(Phase.HALT, now_ns + HALT_TIMEOUT_NS)

    def give_up(self) -> None:
        """The drive is being switched off: it is told to be in csp again, unless bring-up will do that."""
        if self.adopts and self.drive.bring_up.ready:
            self.drive.channel.write(*_MODE, eds.drive_dictionary()[_MODE].pack(CYCLIC_SYNCHRONOUS_POSITION))
        self._go(Phase.DONE)

    def _go(self, phase: Phase, deadline_ns: int = 0) -> None:
        self.phase, self._deadline_ns = phase, deadline_ns
        self._asked, self._answer, self._ticks = False, None, 0
        self.drive.adrift = phase not in (Phase.CONFIGURE, Phase.DONE)

    def _fail(self, why: str) -> None:
        self.failure = self.failure or why

    # --- into homing mode ---------------------------------------------------------------------------------------

    def _configure(self, now_ns: int) -> None:
        if self.failure is not None:
            self._go(Phase.DONE)
        elif not self._rows:
            self._go(Phase.ENTER, now_ns + MODE_TIMEOUT_NS)
        elif self._exchanged(self._rows[0].index, self._rows[0].sub, self._rows[0].packed()):
            row = self._rows.pop(0)
            if isinstance(self._answer, SdoError) and not _dispensable(row, self._answer):
                self._fail(f"writing {object_name(row.index, row.sub)} = {row.value}: {self._answer}")
            self._asked = False

    def _enter(self, now_ns: int) -> None:
        if self._in_mode(HOMING_MODE, now_ns):
            self._go(Phase.RUN, now_ns + self._timeout_ns)
        elif self.failure is not None:
            self._go(Phase.LEAVE, now_ns + MODE_TIMEOUT_NS)

    # --- homing -------------------------------------------------------------------------------------------------

    def _run(self, now_ns: int) -> None:
        status = self.drive.statusword
        if self._ticks <= SETTLE_TICKS:
            return
        if status & Status.HOMING_ERROR:
            self._fail("the drive reports a homing error (statusword bit 13)")
            self._go(Phase.HALT, now_ns + HALT_TIMEOUT_NS)
        elif status & Status.HOMING_ATTAINED and status & Status.TARGET_REACHED:
            self._go(Phase.LEAVE, now_ns + MODE_TIMEOUT_NS)
        elif now_ns > self._deadline_ns:
            self._fail(f"home was not found within {self._timeout_ns * 1e-9:g} s")
            self._go(Phase.HALT, now_ns + HALT_TIMEOUT_NS)

    def _halt(self, now_ns: int) -> None:
        at_rest = self.drive.statusword & Status.TARGET_REACHED  # With the halt bit: velocity is 0.
        if (self._ticks > SETTLE_TICKS and at_rest) or now_ns > self._deadline_ns:
            self._go(Phase.LEAVE, now_ns + MODE_TIMEOUT_NS)

    # --- back ---------------------------------------------------------------------------------------------------

    def _leave(self, now_ns: int) -> None:
        if self._in_mode(CYCLIC_SYNCHRONOUS_POSITION, now_ns):
            self._go(Phase.SETTLE)
        elif self._deadline_ns < now_ns:
            self._fail(f"{object_name(*_MODE_DISPLAY)} does not become {CYCLIC_SYNCHRONOUS_POSITION} again")
            self.stuck = True
            self._go(Phase.DONE)

    def _settle(self, _now_ns: int) -> None:
        """The target has been the actual position for long enough: the drive follows it, and homing is over."""
        drive = self.drive
        if self._ticks <= SETTLE_TICKS:
            return
        self.stuck = drive.state is DriveState.OPERATION_ENABLED and not drive.statusword & Status.FOLLOWS_COMMAND
        if self.stuck:
            self._fail("the drive does not follow its target after homing (statusword bit 12)")
        elif self.failure is None:
            drive.homed, drive.homed_serial = True, drive.bring_up.serial
        self._go(Phase.DONE)

    # --- objects ------------------------------------------------------------------------------------------------

    def _in_mode(self, mode: int, now_ns: int) -> bool:
        """Sets the mode, then reads 0x6061 until it shows; notes a failure."""
        if not self._asked:
            data = eds.drive_dictionary()[_MODE].pack(mode)
            self._asked = True
            self.drive.channel.write(*_MODE, data, self._take)
        elif self._answer is not None:
            answer, self._answer = self._answer, None
            if isinstance(answer, SdoError):
                self._fail(f"{object_name(*_MODE)} = {mode}: {answer}")
            elif answer == bytes((mode,)):
                return True
            elif now_ns > self._deadline_ns:
                self._fail(f"{object_name(*_MODE_DISPLAY)} does not become {mode}")
            else:
                self.drive.channel.read(*_MODE_DISPLAY, self._take)
        return False

    def _exchanged(self, index: int, sub: int, data: bytes) -> bool:
        if not self._asked:
            self._asked, self._answer = True, None
            self.drive.channel.write(index, sub, data, self._take)
        return self._answer is not None

    def _take(self, answer: bytes | SdoError) -> None:
        self._answer = answer


_STEPS = {
    Phase.CONFIGURE: DriveHoming._configure,
    Phase.ENTER: DriveHoming._enter,
    Phase.RUN: DriveHoming._run,
    Phase.HALT: DriveHoming._halt,
    Phase.LEAVE: DriveHoming._leave,
    Phase.SETTLE: DriveHoming._settle,
}


def _dispensable(row: Row, error: SdoError) -> bool:
    return row.optional and error.abort in (NO_OBJECT, NO_SUB_INDEX)
