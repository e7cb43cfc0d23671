"""One drive as the cycle sees it: its newest process data, its signs of life, and whether it can be trusted."""

from dataclasses import dataclass, field

from axisync_schemas.cell import Axis, Cell
from axisync_schemas.enumerations import DriveState, NmtState
from axisync_service.canopen.emcy import Emergency, describe, parse_emergency
from axisync_service.canopen.nmt import parse_heartbeat
from axisync_service.canopen.pdo import TPDO1_SIZE, TPDO2_SIZE, parse_tpdo1, parse_tpdo2
from axisync_service.drives.bring_up import BringUp
from axisync_service.drives.bring_up import Phase as BringUpPhase
from axisync_service.drives.cia402 import Status, state_of
from axisync_service.drives.health import Health
from axisync_service.drives.sdo_channel import SdoChannel
from axisync_service.mapper.counts import unwrap_int32

JUMP_MARGIN = 1.5
"""How much faster than the axis's limit an actual position may go: drives overshoot."""
JUMP_COUNTS = 20
"""Of noise, whatever the speed."""

_READY, _OPERATIONAL, _ENABLED = BringUpPhase.READY, NmtState.OPERATIONAL, DriveState.OPERATION_ENABLED
_FOLLOWS_COMMAND = int(Status.FOLLOWS_COMMAND)
"""Of the enumerations, here once: Python 3.11 takes 0.2 us to look a member up, too long for each drive and tick."""


@dataclass(slots=True)
class DriveLink:
    """Fed with frames, asked each tick.

    Attributes:
        actual: newest position actual value, counts, unwrapped.
        known: a TPDO has come since the last bring-up.
        missed: executed ticks in a row without a TPDO.
        same: samples in a row that were equal to the one before. jump: counts of a step that no axis can make, else 0.
        rebooted: a boot-up frame came since the caller last looked.
        emergency: the last EMCY that reported an error; None after "no error".
        homed: home was found, by the drive with serial number `homed_serial`, and has not been lost since.
        adrift: positions have no meaning for the moment, the drive is finding its home.
    """

    cell: Cell
    axis: Axis
    bring_up: BringUp = field(init=False)
    channel: SdoChannel = field(default_factory=SdoChannel)
    health: Health = field(init=False)
    statusword: int = 0
    state: DriveState = DriveState.UNKNOWN
    actual: int = 0
    known: bool = False
    missed: int = 0
    same: int = 0
    jump: int = 0
    rebooted: bool = False
    emergency: Emergency | None = None
    new_emergencies: list[Emergency] = field(default_factory=list)
    homed: bool = False
    homed_serial: int = 0
    adrift: bool = False
    _measured: tuple[int, int] | None = None
    _raw: int = 0
    _fresh: bool = False
    _heartbeat_ns: int = 0
    _silence_ns: int = 0
    _centre: int = 0
    _step_max: int = 0
    _missed_max: int = 0

    def __post_init__(self) -> None:
        drive = self.axis.drive
        self.bring_up = BringUp(self.cell, self.axis)
        self.health = Health(self.axis)
        self._missed_max = self.cell.tpdo_missed_max
        self._silence_ns = round(self.cell.drive_heartbeat_timeout * 1e9)
        self._centre = round((sum(self.axis.hard_limits) / 2 - drive.offset) * drive.counts_per_rad)
        speed = self.axis.limits.velocity * abs(drive.counts_per_rad) * JUMP_MARGIN
        # Samples are taken at SYNCs, of which one may be late by a whole period.
        self._step_max = JUMP_COUNTS + round(2 * speed * self.cell.period)

    @property
    def nmt(self) -> NmtState:
        """State by the newest heartbeat."""
        return self.bring_up.nmt

    @property
    def needs_homing(self) -> bool:
        """The axis must be homed before it may move."""
        return self.axis.drive.homing is not None and not self.homed

    @property
    def velocity(self) -> float | None:
        """As the drive measures it, rad/s; None until a TPDO2 came."""
        drive = self.axis.drive
        return self._measured[0] * drive.units.speed / drive.counts_per_rad if self._measured else None

    @property
    def torque(self) -> float | None:
        """Share of the rated torque; None until a TPDO2 came."""
        return self._measured[1] * 1e-3 if self._measured else None

    # --- frames -------------------------------------------------------------------------------------------------

    def on_tpdo1(self, data: bytes) -> None:
        """Statusword and actual position; a frame of another length is none of ours."""
        if len(data) != TPDO1_SIZE:
            return
        statusword, raw = parse_tpdo1(data)
        if statusword != self.statusword:
            self.statusword, self.state = statusword, state_of(statusword)
        step = raw - self._raw
        if not self.known or self.adrift or not -self._step_max <= step <= self._step_max:
            self._move_to(raw)
        elif step:
            self.actual += step
            self._raw, self.same, self.jump = raw, 0, 0
        else:
            self.same += 1
            self.jump = 0
        self.known = self._fresh = True

    def _move_to(self, raw: int) -> None:
        """The INT32 may have wrapped: the true position is the one nearest to the last, at first the one in range."""
        trusted = self.known and not self.adrift
        before = self.actual if trusted else self._centre
        self.actual = unwrap_int32(raw, before)
        step = self.actual - before
        self.jump = step if trusted and abs(step) > self._step_max * (1 + self.missed) else 0
        self._raw, self.same = raw, 0

    def on_tpdo2(self, data: bytes) -> None:
        """Velocity and torque, at a low rate."""
        if len(data) == TPDO2_SIZE:
            self._measured = parse_tpdo2(data)

    def on_heartbeat(self, data: bytes, now_ns: int) -> None:
        """Heartbeat or boot-up."""
        state = parse_heartbeat(data)
        self._heartbeat_ns = now_ns
        if state is NmtState.BOOT_UP:
            self._on_boot_up()
        self.bring_up.nmt = state

    def _on_boot_up(self) -> None:
        # The boot-up at power-on, before anything was configured, is expected.
        if self.bring_up.phase not in (BringUpPhase.PRESENCE, BringUpPhase.FAILED):
            self.rebooted = True
        self.lose()

    def on_emergency(self, data: bytes) -> None:
        """EMCY; code 0 clears the last one."""
        emergency = parse_emergency(data)
        if emergency is None:
            return
        self.emergency = emergency if emergency.code else None
        if emergency.code and len(self.new_emergencies) < 8:
            self.new_emergencies.append(emergency)

    # --- its life -----------------------------------------------------------------------------------------------

    def lose(self) -> None:
        """Nothing known about it holds any longer; bring-up begins anew."""
        self.statusword, self.state = 0, DriveState.UNKNOWN
        self.known = self._fresh = self.adrift = False
        self.missed = self.same = self.jump = 0
        self._measured = None
        self.health.forget()
        self.channel.close()
        self.bring_up.restart()
        self.bring_up.listens = self.homed and self.axis.drive.encoder == "incremental"

    def end_of_read(self, now_ns: int) -> str | None:
        """Call once each executed tick after the frames: what was lost just now, in words."""
        if self._fresh:
            self._fresh, self.missed = False, 0
        elif self.known:
            self.missed += 1
            self.same = self.jump = 0
        if now_ns - self._heartbeat_ns > self._silence_ns and self.nmt is not NmtState.UNKNOWN:
            self.bring_up.nmt = NmtState.UNKNOWN
            self.lose()
            return f"heartbeat of {self.axis.name} lost for {self.cell.drive_heartbeat_timeout * 1e3:g} ms"
        return None

    def adopt_home(self, serial: int) -> None:
        """What an earlier run found out: this axis was homed with the drive that has this serial number."""
        self.homed, self.homed_serial = self.axis.drive.homing is not None, serial
        self.bring_up.listens = self.homed and self.axis.drive.encoder == "incremental"

    def home_lost(self) -> str | None:
        """Clears the homed flag where bring-up has found that it no longer holds; why, in words."""
        if not self.homed:
            return None
        bring_up, why = self.bring_up, None
        if bring_up.foreign:
            why = "another drive answers"
        elif bring_up.phase is BringUpPhase.PRE_OPERATIONAL:
            if bring_up.serial != self.homed_serial:
                why = f"the drive's serial number is {bring_up.serial}, it was homed with {self.homed_serial}"
            elif bring_up.listens and not bring_up.was_operational:
                why = "its incremental encoder has lost power"
        self.homed = why is None
        return why

    # --- trust --------------------------------------------------------------------------------------------------

    def distrust(self) -> str | None:
        """Why an enabled drive cannot be trusted any longer, in words; None while all is well."""
        if self.rebooted:
            return "drive restarted"
        bring_up = self.bring_up
        if not self.known or bring_up.phase is not _READY:
            return "drive lost"
        if bring_up.nmt is not _OPERATIONAL:
            return f"drive left NMT operational, is {bring_up.nmt.label}"
        if self.missed >= self._missed_max:
            return f"no TPDO for {self.missed} ticks"
        if self.state is not _ENABLED:
            return f"drive left operation enabled, is {self.state.label}" + self._because()
        if self.adrift:
            return None
        if not self.statusword & _FOLLOWS_COMMAND:
            return "drive does not follow its target (statusword bit 12)"
        if self.jump:
            return f"its position jumped by {self.jump} counts within one cycle"
        return None

    def _because(self) -> str:
        if self.health.torque_is_off:
            return ": safe torque off is active"
        return f": {describe(self.emergency.code)}" if self.emergency else ""

    def why_not_enabled(self) -> str:
        """For a drive that did not reach operation enabled: where it is, and what may keep it there."""
        because = self._because()
        if not because and not self.statusword & Status.VOLTAGE_ENABLED:
            because = ": no voltage at its power stage (statusword bit 4)"
        return f"{self.axis.name} is {self.state.label}{because}"
