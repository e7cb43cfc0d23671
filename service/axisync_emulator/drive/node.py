"""A drive: its CANopen services and its profile, put together on one port of a bus."""

from axisync_emulator.drive.emergency import Emergencies, ErrorCode
from axisync_emulator.drive.heartbeat import HeartbeatConsumer, HeartbeatProducer
from axisync_emulator.drive.motor import Motor
from axisync_emulator.drive.nmt import NEXT_STATE, NMT_COB_ID, NmtCommand, NmtState, command_for
from axisync_emulator.drive.object_dictionary import Objects
from axisync_emulator.drive.objects import bind
from axisync_emulator.drive.pdo import Rpdo, Tpdo
from axisync_emulator.drive.profile import Profile
from axisync_emulator.drive.sdo import SdoService
from axisync_emulator.drive.specification import DriveSpecification
from axisync_emulator.drive.sync import SyncConsumer
from axisync_emulator.segment import Handler, Port
from axisync_emulator.timers import NEVER

RESPONSE_NS = 20_000
"""From a SYNC to the PDOs that it triggers."""
SYNC_SLACK = 1.5
"""SYNC counts as lost this many periods after the last one that may be missing: it may be late by half a period."""
_COMMUNICATION_OBJECTS = 0x1000, 0x1FFF


class Drive:
    """One drive.

    Times are bus times: of the last bit of the frame that is handled, or of the timer that fired. What the drive does
    depends on nothing else.
    """

    def __init__(self, specification: DriveSpecification, port: Port) -> None:
        self.specification = specification
        self.node_id = specification.node_id
        self._port = port
        self.nmt = NmtState.BOOT_UP
        self.emergencies = Emergencies()
        self.motor = Motor(specification)
        self.objects = Objects(self.node_id, _factory(specification))
        self.profile = Profile(
            specification, self.motor, self.emergencies, self.objects.number, port.timer, self._fault, self._reset_done
        )
        self.sync = SyncConsumer()
        bind(self)
        self.rpdo = Rpdo(self.objects, 0x1400)
        self.tpdos = (Tpdo(self.objects, 0x1800), Tpdo(self.objects, 0x1801))
        self._sdo = SdoService(self.objects, port)
        self._heartbeat = HeartbeatProducer(self.node_id, port, lambda: self.nmt)
        self._master = HeartbeatConsumer(port, self._master_lost, self._master_back)
        self._sync_lost = port.timer(self._on_sync_lost)
        self._rpdo_lost = port.timer(self._on_rpdo_timeout)
        self._missed = 0
        self._heard: dict[int, Handler] = {}
        for index in (0x1005, 0x1006, 0x1007, 0x1016, 0x1017, 0x1019, 0x1400, 0x1600, 0x1800, 0x1801, 0x1A00, 0x1A01,
                      0x2000, 0x6065, 0x6066, 0x607D, 0x60C2):  # fmt: skip
            self.objects.changed[index] = self._changed(index)

    # Configuration.

    def power_on(self, now: int) -> None:
        """Boots: sends the boot-up message and is pre-operational."""
        self._boot(now, 0x1000, 0xFFFF)

    def _boot(self, now: int, first: int, last: int) -> None:
        self.objects.reset(first, last)
        self.objects.now = now
        self._sdo.restart()
        self.emergencies.active.clear()
        self.nmt = NmtState.PRE_OPERATIONAL
        self._heartbeat.boot_up(now)
        self._configure(now)
        self._heartbeat.configure(self.objects.number(0x1017), now)
        self._master.configure(self.objects.number(0x1016, 1))

    def _changed(self, index: int):  # type: ignore[no-untyped-def]
        def react(now: int) -> None:
            if index == 0x1017:
                self._heartbeat.configure(self.objects.number(0x1017), now)
            elif index == 0x1016:
                self._master.configure(self.objects.number(0x1016, 1))
            else:
                self._configure(now)

        return react

    def _configure(self, now: int) -> None:
        """Takes over what the object dictionary says."""
        number = self.objects.number
        self._window_ns = number(0x1007) * 1000 or NEVER
        self._tolerated = number(0x2000)
        self._lost_ns = round((self._tolerated + SYNC_SLACK) * number(0x1006) * 1000)
        self.sync.overflow = number(0x1019)
        self.sync.restart()
        self.profile.configure()
        self.rpdo.configure()
        for tpdo in self.tpdos:
            tpdo.configure()
        self._listen()
        if not self._lost_ns:
            self._sync_lost.cancel()

    def _listen(self) -> None:
        """Sets the acceptance filters."""
        for can_id, handler in self._heard.items():
            self._port.ignore(can_id, handler)
        self._heard = {
            NMT_COB_ID: self._on_nmt,
            self._sdo.request_id: self._on_sdo,
            self.objects.number(0x1005) & 0x7FF: self._on_sync,
        }
        if self.rpdo.valid:
            self._heard[self.rpdo.cob_id] = self._on_rpdo
        for can_id, handler in self._heard.items():
            self._port.listen(can_id, handler)
