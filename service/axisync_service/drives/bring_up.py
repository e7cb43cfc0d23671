"""Bring-up of one drive: presence, identity, configuration with read-back, NMT operational. A pure state machine."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum, auto

from axisync_schemas import eds
from axisync_schemas.cell import Axis, Cell
from axisync_schemas.enumerations import NmtState
from axisync_service.canopen.nmt import NmtCommand
from axisync_service.canopen.sdo import NO_OBJECT, NO_SUB_INDEX, SdoClient, SdoError
from axisync_service.drives.configuration import CSP_SUPPORTED, Row, rows

RETRY_NS = 1_000_000_000
NMT_TIMEOUT_NS = 500_000_000
UNASKED_MAX = 3
"""SDO responses that no request of a bring-up explains: a late one or two are nothing, more are another node's."""


class Phase(Enum):
    """Where a bring-up is."""

    PRESENCE = auto()
    IDENTITY = auto()
    SERIAL = auto()
    MODES = auto()
    LISTEN = auto()
    PRE_OPERATIONAL = auto()
    CONFIGURE = auto()
    VERIFY = auto()
    HISTORY = auto()
    START = auto()
    READY = auto()
    FAILED = auto()


_READY = Phase.READY
"""Asked for by each drive and tick: Python 3.11 takes 0.2 us to look a member up."""


@dataclass(slots=True)
class BringUp:
    """Brings one node up and says why it could not. `step` is called each tick; `sdo` is polled by the cycle.

    Attributes:
        nmt: the node's state by its heartbeat; kept by the caller.
        command: an NMT command to send now; the caller takes it away.
        history: error codes that the drive remembered (0x1003), newest first.
        failure: one sentence, when FAILED.
        serial: serial number (0x1018:4), 0 where the drive has none.
        listens: waits for a heartbeat before anything is changed, since its state tells whether power was lost.
        foreign: another drive than the cell file's answered since the last restart.
        was_operational: the node was operational when bring-up found it: it has not lost power since it was brought up.
    """

    cell: Cell
    axis: Axis
    sdo: SdoClient = field(default_factory=SdoClient)
    phase: Phase = Phase.PRESENCE
    nmt: NmtState = NmtState.UNKNOWN
    command: NmtCommand | None = None
    history: tuple[int, ...] = ()
    failure: str | None = None
    serial: int = 0
    listens: bool = False
    was_operational: bool = False
    foreign: bool = False
    _rows: tuple[Row, ...] = ()
    _row: int = 0
    _asked: bool = False
    _deadline_ns: int = 0
    _history_length: int = 0
    _history: list[int] = field(default_factory=list)

    @property
    def ready(self) -> bool:
        """The node is configured and operational."""
        return self.phase is _READY

    def restart(self) -> None:
        """Begins anew, after a boot-up frame or a lost heartbeat."""
        self.failure, self.foreign = None, False
        self._begin()

    def retry(self) -> None:
        """Begins anew after a failure, at once."""
        if self.nmt is NmtState.STOPPED:  # There a node answers no SDO (CiA 301, table 38).
            self.command = NmtCommand.ENTER_PRE_OPERATIONAL
        self._begin()

    def _begin(self) -> None:
        self.sdo = SdoClient(self.sdo.timeout_ns)
        self.phase = Phase.PRESENCE
        self._asked = False

    def step(self, now_ns: int) -> None:
        """Moves on as far as the answers received allow; what follows an answer is asked in the same tick."""
        _STEPS[self.phase](self, now_ns)
        if not self._asked:
            _STEPS[self.phase](self, now_ns)

    def _go(self, phase: Phase, now_ns: int = 0, wait_ns: int = 0) -> None:
        self.phase = phase
        self._asked = False
        self._deadline_ns = now_ns + wait_ns

    def _fail(self, now_ns: int, why: str) -> None:
        drive = self.axis.drive
        self.failure = f"axis {self.axis.name} (bus {drive.bus}, node {drive.node_id}): {why}"
        self._go(Phase.FAILED, now_ns, RETRY_NS)

    def _answer(self, request: Callable[[], None]) -> bytes | SdoError | None:
        """Sends the request once, then the answer when it is there."""
        if not self._asked:
            self._asked = True
            request()
            return None
        if not self.sdo.idle:
            return None
        self._asked = False
        return self.sdo.result

    def _presence(self, now_ns: int) -> None:
        """A node that is there answers SDO, whether or not it sends heartbeats yet."""
        answer = self._answer(lambda: self.sdo.upload(0x1018, 1))
        if isinstance(answer, SdoError):
            self._fail(now_ns, f"does not answer ({object_name(0x1018, 1)}: {answer})")
        elif answer is not None:
            self._identity_checked(now_ns, answer, "vendor_id", self.axis.drive.identity.vendor_id, Phase.IDENTITY)

    def _identity(self, now_ns: int) -> None:
        answer = self._answer(lambda: self.sdo.upload(0x1018, 2))
        if isinstance(answer, SdoError):
            self._fail(now_ns, f"{object_name(0x1018, 2)}: {answer}")
        elif answer is not None:
            expected = self.axis.drive.identity.product_code
            self._identity_checked(now_ns, answer, "product_code", expected, Phase.SERIAL)

    def _identity_checked(self, now_ns: int, answer: bytes, what: str, expected: int, then: Phase) -> None:
        found = int.from_bytes(answer, "little")
        if found != expected:
            self.foreign = True
            self._fail(now_ns, f"{what} is 0x{found:08X}, the cell file says 0x{expected:08X}: stays pre-operational")
        else:
            self._go(then, now_ns, NMT_TIMEOUT_NS)

    def _serial(self, now_ns: int) -> None:
        answer = self._answer(lambda: self.sdo.upload(0x1018, 4))
        if isinstance(answer, SdoError) and answer.abort not in (NO_OBJECT, NO_SUB_INDEX):
            self._fail(now_ns, f"{object_name(0x1018, 4)}: {answer}")
        elif answer is not None:
            found = answer if isinstance(answer, bytes) else b""
            self.serial = int.from_bytes(found, "little")
            expected = self.axis.drive.identity.serial_number
            wanted = self.serial if expected is None else expected
            self._identity_checked(now_ns, found, "serial_number", wanted, Phase.MODES)

    def _modes(self, now_ns: int) -> None:
        """A drive without csp is refused here; one that does not say what it can do gets the benefit of the doubt."""
        answer = self._answer(lambda: self.sdo.upload(0x6502, 0))
        if isinstance(answer, bytes) and not int.from_bytes(answer, "little") & CSP_SUPPORTED:
            self._fail(now_ns, f"{object_name(0x6502, 0)} does not have cyclic synchronous position (bit 7)")
        elif answer is not None:
            self._go(Phase.LISTEN, now_ns, round(self.cell.drive_heartbeat_timeout * 1e9))

    def _listen(self, now_ns: int) -> None:
        if not self.listens or self.nmt is not NmtState.UNKNOWN or now_ns > self._deadline_ns:
            self.was_operational = self.nmt is NmtState.OPERATIONAL
            self._go(Phase.PRE_OPERATIONAL, now_ns, NMT_TIMEOUT_NS)

    def _pre_operational(self, now_ns: int) -> None:
        if not self._asked:
            self._asked = True
            self.command = NmtCommand.ENTER_PRE_OPERATIONAL
            self._rows, self._row = rows(self.cell, self.axis), 0
            return
        # No heartbeat may be configured yet: the command is not acknowledged, the configuration shows whether it held.
        self._go(Phase.CONFIGURE)

    def _configure(self, now_ns: int) -> None:
        row = self._rows[self._row]
        answer = self._answer(lambda: self.sdo.download(row.index, row.sub, row.packed()))
        if isinstance(answer, SdoError):
            if row.optional and answer.abort in (NO_OBJECT, NO_SUB_INDEX):
                self._next_row()
            else:
                self._fail(now_ns, f"writing {object_name(row.index, row.sub)} = {row.value}: {answer}")
        elif answer is not None:
            if row.verify:
                self._go(Phase.VERIFY)
            else:
                self._next_row()

    def _verify(self, now_ns: int) -> None:
        row = self._rows[self._row]
        answer = self._answer(lambda: self.sdo.upload(row.index, row.sub))
        if isinstance(answer, SdoError):
            self._fail(now_ns, f"reading back {object_name(row.index, row.sub)}: {answer}")
        elif answer is not None:
            if not row.holds(answer):
                found = int.from_bytes(answer, "little", signed=row.value < 0)
                self._fail(now_ns, f"{object_name(row.index, row.sub)} reads back {found}, not {row.value}")
            else:
                self._next_row()

    def _next_row(self) -> None:
        self._row += 1
        self._history_length, self._history = -1, []
        self._go(Phase.CONFIGURE if self._row < len(self._rows) else Phase.HISTORY)

    def _read_history(self, now_ns: int) -> None:
        """Error history 0x1003: sub-index 0 counts, 1 is the newest (CiA 301, 7.5.2.4)."""
        sub = len(self._history) + 1 if self._history_length >= 0 else 0
        answer = self._answer(lambda: self.sdo.upload(0x1003, sub))
        if answer is None:
            return
        if isinstance(answer, SdoError):
            self._history_length = 0
        elif self._history_length < 0:
            self._history_length = min(int.from_bytes(answer, "little"), 8)
        else:
            self._history.append(int.from_bytes(answer[:2], "little"))
        if len(self._history) >= self._history_length:
            self.history = tuple(self._history)
            self._go(Phase.START, now_ns, NMT_TIMEOUT_NS + round(2e9 * self.cell.drive_heartbeat))

    def _start(self, now_ns: int) -> None:
        if self.sdo.unasked > UNASKED_MAX:
            self._fail(now_ns, "two nodes answer under this node id, or another SDO client asks: stays pre-operational")
        elif not self._asked:
            self._asked = True
            self.command = NmtCommand.START
        elif self.nmt is NmtState.OPERATIONAL:
            self.failure = None
            self._go(Phase.READY)
        elif now_ns > self._deadline_ns:
            self._fail(now_ns, f"does not become operational, its heartbeat says {self.nmt.label}")

    def _ready(self, _now_ns: int) -> None:
        """Nothing left to do."""

    def _failed(self, now_ns: int) -> None:
        """Tries again after a while; until that has led somewhere, the failure stands."""
        if now_ns > self._deadline_ns:
            self.retry()


_STEPS = {
    Phase.PRESENCE: BringUp._presence,
    Phase.IDENTITY: BringUp._identity,
    Phase.SERIAL: BringUp._serial,
    Phase.MODES: BringUp._modes,
    Phase.LISTEN: BringUp._listen,
    Phase.PRE_OPERATIONAL: BringUp._pre_operational,
    Phase.CONFIGURE: BringUp._configure,
    Phase.VERIFY: BringUp._verify,
    Phase.HISTORY: BringUp._read_history,
    Phase.START: BringUp._start,
    Phase.READY: BringUp._ready,
    Phase.FAILED: BringUp._failed,
}


def object_name(index: int, sub: int) -> str:
    """An object as people know it: index, sub-index and the EDS's name."""
    return eds.drive_dictionary().describe(index, sub)
