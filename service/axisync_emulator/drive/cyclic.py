"""The cycle of a drive: SYNC in, buffered RPDO made valid, TPDOs out; and what happens when one of them is missing."""

from axisync_emulator.drive.emergency import Emergencies, ErrorCode
from axisync_emulator.drive.motor import Motor
from axisync_emulator.drive.object_dictionary import Objects
from axisync_emulator.drive.pdo import Rpdo, Tpdo
from axisync_emulator.drive.profile import Profile
from axisync_emulator.drive.sync import SyncConsumer
from axisync_emulator.segment import Port
from axisync_emulator.timers import NEVER

RESPONSE_NS = 20_000
"""From a SYNC to the PDOs that it triggers."""
SYNC_SLACK = 1.5
"""SYNC counts as lost this many periods after the last one that may be missing: it may come half a period late."""


class Cyclic:
    """Synchronous operation. An RPDO that arrives in cycle c takes effect with the SYNC of cycle c + 1 and no other:
    what is late, or followed by a gap in the SYNC counter, is discarded and the drive goes on by itself."""

    def __init__(self, port: Port, objects: Objects, profile: Profile, motor: Motor, emergencies: Emergencies) -> None:
        self._port = port
        self._objects = objects
        self._profile = profile
        self._motor = motor
        self._emergencies = emergencies
        self.sync = SyncConsumer()
        self.rpdo = Rpdo(objects, 0x1400)
        self.tpdos = (Tpdo(objects, 0x1800), Tpdo(objects, 0x1801))
        self.operational = False
        self._sync_lost = port.timer(self._on_sync_lost)
        self._rpdo_lost = port.timer(self._on_rpdo_timeout)
        self._missed = 0
        self._tolerated = self._cycles = 0
        self._lost_ns = 0
        self._window_ns = NEVER

    # Configuration: each takes over what the object dictionary says.

    def configure(self) -> None:
        """All of it."""
        self.configure_timing()
        self.configure_sync()
        self.rpdo.configure()
        for tpdo in self.tpdos:
            tpdo.configure()

    def configure_timing(self) -> None:
        """0x1006, 0x1007, 0x2000."""
        number = self._objects.number
        self._window_ns = number(0x1007) * 1000 or NEVER
        self._tolerated = number(0x2000)
        self._lost_ns = round((self._tolerated + SYNC_SLACK) * number(0x1006) * 1000)
        if not self._lost_ns:
            self._sync_lost.cancel()

    def configure_sync(self) -> None:
        """0x1019."""
        self.sync.overflow = self._objects.number(0x1019)
        self.sync.restart()

    def start(self) -> None:
        """NMT start: counting begins anew."""
        self.operational = True
        self.rpdo.buffer = None
        self._missed = self._cycles = 0
        for tpdo in self.tpdos:
            tpdo.restart()

    def stop(self) -> None:
        """No PDOs any more, and nobody misses them."""
        self.operational = False
        self._sync_lost.cancel()
        self._rpdo_lost.cancel()

    # Frames.

    def on_sync(self, data: bytes, now: int) -> None:
        """A SYNC: outputs of the last cycle become valid, inputs are sampled at this instant."""
        advance = self.sync.receive(data, now)
        if advance <= 0:
            if advance < 0:
                self._emergencies.occur(ErrorCode.SYNC_LENGTH, now)
            return
        if not self.operational:
            return
        if self._lost_ns:
            self._sync_lost.set(now + self._lost_ns)
        if self._emergencies.active:
            self._emergencies.heal(now, ErrorCode.SYNC_LOST, ErrorCode.SYNC_LENGTH)
        self._motor.advance(now)
        if self.rpdo.valid and self.rpdo.synchronous:
            self._validate(advance, now)
        self._profile.watch_following_error(now)
        for tpdo in self.tpdos:
            if tpdo.valid and tpdo.due(advance, self.sync.counter):
                self._port.send(tpdo.cob_id, tpdo.build(now), now + RESPONSE_NS)

    def _validate(self, advance: int, now: int) -> None:
        data, self.rpdo.buffer = self.rpdo.buffer, None
        self._cycles += advance
        if data is not None and advance == 1:
            self._missed = 0
            self._apply(data, now)
            return
        # Each SYNC in a gap lacked its RPDO; this SYNC's was to be sent within the gap, and is no further loss.
        self._missed += max(1, advance - 1)
        if self._missed > self._tolerated and self._profile.enabled:
            self._rpdo_missing(now)

    def _apply(self, data: bytes, now: int) -> None:
        if self._emergencies.active:
            self._emergencies.heal(now, ErrorCode.RPDO_TIMEOUT, ErrorCode.PDO_LENGTH)
        self.rpdo.apply(data, now)
        self._profile.control(now)
        self._profile.follow(now, max(1, self._cycles))
        self._cycles = 0

    def on_rpdo(self, data: bytes, now: int) -> None:
        """A target: kept for the next SYNC, unless it comes after the window for this one."""
        if not self.operational:
            return
        if len(data) < self.rpdo.struct.size:
            self._emergencies.occur(ErrorCode.PDO_LENGTH, now)
            return
        if self.rpdo.timeout_ns:
            self._rpdo_lost.set(now + self.rpdo.timeout_ns)
        if not self.rpdo.synchronous:
            self._apply(data, now)
        elif now - self.sync.time <= self._window_ns:
            self.rpdo.buffer = data

    # What is missing.

    def _on_sync_lost(self, now: int) -> None:
        if self.operational and self._profile.enabled and self._emergencies.occur(ErrorCode.SYNC_LOST, now):
            self._profile.quick_stop(now)

    def _on_rpdo_timeout(self, now: int) -> None:
        if self.operational and self._profile.enabled:
            self._rpdo_missing(now)

    def _rpdo_missing(self, now: int) -> None:
        if self._emergencies.occur(ErrorCode.RPDO_TIMEOUT, now):
            self._profile.quick_stop(now)
