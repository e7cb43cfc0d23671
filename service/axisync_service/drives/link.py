"""One drive as the cycle sees it: its newest process data, its signs of life, and whether it can be trusted."""

from dataclasses import dataclass, field

from axisync_schemas.cell import Axis, Cell
from axisync_schemas.enumerations import DriveState, NmtState
from axisync_service.canopen.emcy import Emergency, describe, parse_emergency
from axisync_service.canopen.nmt import parse_heartbeat
from axisync_service.canopen.pdo import TPDO1_SIZE, parse_tpdo1
from axisync_service.drives.bring_up import BringUp
from axisync_service.drives.bring_up import Phase as BringUpPhase
from axisync_service.drives.cia402 import Status, state_of
from axisync_service.mapper.counts import unwrap_int32


@dataclass(slots=True)
class DriveLink:
    """Fed with frames, asked each tick.

    Attributes:
        actual: newest position actual value, counts, unwrapped.
        known: a TPDO has come since the last bring-up.
        missed: executed ticks in a row without a TPDO.
        rebooted: a boot-up frame came since the caller last looked.
        emergency: the last EMCY that reported an error; None after "no error".
    """

    cell: Cell
    axis: Axis
    bring_up: BringUp = field(init=False)
    statusword: int = 0
    state: DriveState = DriveState.UNKNOWN
    actual: int = 0
    known: bool = False
    missed: int = 0
    rebooted: bool = False
    emergency: Emergency | None = None
    new_emergencies: list[Emergency] = field(default_factory=list)
    _fresh: bool = False
    _heartbeat_ns: int = 0

    def __post_init__(self) -> None:
        self.bring_up = BringUp(self.cell, self.axis)

    @property
    def nmt(self) -> NmtState:
        """State by the newest heartbeat."""
        return self.bring_up.nmt

    def on_tpdo1(self, data: bytes) -> None:
        """Statusword and actual position; a frame of another length is none of ours."""
        if len(data) != TPDO1_SIZE:
            return
        self.statusword, raw = parse_tpdo1(data)
        self.state = state_of(self.statusword)
        self.actual = unwrap_int32(raw, self.actual) if self.known else raw
        self.known = self._fresh = True

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

    def lose(self) -> None:
        """Nothing known about it holds any longer; bring-up begins anew."""
        self.statusword, self.state = 0, DriveState.UNKNOWN
        self.known = self._fresh = False
        self.missed = 0
        self.bring_up.restart()

    def end_of_read(self, now_ns: int) -> str | None:
        """Call once each executed tick after the frames: what was lost just now, in words."""
        if self._fresh:
            self._fresh, self.missed = False, 0
        elif self.known:
            self.missed += 1
        if self.nmt is not NmtState.UNKNOWN and now_ns - self._heartbeat_ns > self.cell.drive_heartbeat_timeout * 1e9:
            self.bring_up.nmt = NmtState.UNKNOWN
            self.lose()
            return f"heartbeat of {self.axis.name} lost for {self.cell.drive_heartbeat_timeout * 1e3:g} ms"
        return None

    def distrust(self) -> str | None:
        """Why an enabled drive cannot be trusted any longer, in words; None while all is well."""
        if self.rebooted:
            return "drive restarted"
        if not self.bring_up.ready or not self.known:
            return "drive lost"
        if self.nmt is not NmtState.OPERATIONAL:
            return f"drive left NMT operational, is {self.nmt.label}"
        if self.missed >= self.cell.tpdo_missed_max:
            return f"no TPDO for {self.missed} ticks"
        if self.state is not DriveState.OPERATION_ENABLED:
            why = f": {describe(self.emergency.code)}" if self.emergency else ""
            return f"drive left operation enabled, is {self.state.label}{why}"
        if not self.statusword & Status.FOLLOWS_COMMAND:
            return "drive does not follow its target (statusword bit 12)"
        return None
