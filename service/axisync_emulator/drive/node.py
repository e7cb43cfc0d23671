"""A drive: its CANopen services and its profile, put together on one port of a bus."""

from axisync_emulator.drive.cyclic import Cyclic
from axisync_emulator.drive.emergency import Emergencies, ErrorCode
from axisync_emulator.drive.health import Health
from axisync_emulator.drive.heartbeat import HeartbeatConsumer, HeartbeatProducer
from axisync_emulator.drive.inputs import Inputs
from axisync_emulator.drive.motor import Motor
from axisync_emulator.drive.nmt import NEXT_STATE, NMT_COB_ID, NmtCommand, NmtState, command_for
from axisync_emulator.drive.object_dictionary import Changed, Key, Objects
from axisync_emulator.drive.process_data import Parts, bind
from axisync_emulator.drive.profile import Profile
from axisync_emulator.drive.sdo import SdoService
from axisync_emulator.drive.specification import DriveSpecification
from axisync_emulator.segment import Handler, Port

_COMMUNICATION = 0x1000, 0x1FFF
_EVERYTHING = 0x1000, 0xFFFF
_STATE_AFTER_ERROR = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}
"""0x1029:1 -> state after a communication error; 1: the same as before."""
_INHIBIT_UNIT_NS = 100_000
"""Of 0x1015."""


class Drive:
    """One drive.

    All times are bus times: of the last bit of the frame that is handled, or of the timer that fired. What the drive
    does depends on nothing else.
    """

    def __init__(self, specification: DriveSpecification, port: Port) -> None:
        self.specification = specification
        self.nmt = NmtState.BOOT_UP
        self._port = port
        node_id = self._node_id = specification.node_id
        self.emergencies = Emergencies(node_id, self._send_emergency)
        self.motor = Motor(specification)
        self.inputs = Inputs(specification)
        self.objects = Objects(node_id, _factory(specification))
        self.profile = Profile(
            specification, self.motor, self.inputs, self.emergencies, self.objects.number, port.timer, self.fault,
            self.emergencies.reset,
        )  # fmt: skip
        self.health = Health(port.timer, self.fault, self.emergencies.heal, self._warn)
        bind(self.objects, Parts(self.motor, self.profile, self.inputs, self.health, self.emergencies))
        self.cyclic = Cyclic(port, self.objects, self.profile, self.motor, self.emergencies)
        self.sdo = SdoService(self.objects, port)
        self.heartbeat = HeartbeatProducer(node_id, port, lambda: self.nmt)
        self._master = HeartbeatConsumer(port, self._master_lost, self._master_back)
        self._heard: dict[int, Handler] = {}
        self.objects.changed.update(self._reactions())

    # Power.

    def power_on(self, now: int) -> None:
        """Sends the boot-up message; then the drive is pre-operational."""
        self._boot(now, _EVERYTHING)

    def power_off(self, now: int) -> None:
        """From now on it is silent and without torque; the brake holds the axis."""
        self.nmt = NmtState.BOOT_UP
        self.cyclic.stop()
        self.profile.restart(now)
        self.profile.homing.forget()
        self.emergencies.forget()
        self.heartbeat.configure(0, now)
        self._master.configure(0)
        self._ignore()

    def lose_position(self, now: int) -> None:
        """An incremental encoder counts from 0 after it has been without power."""
        self.motor.refer(-self.motor.mechanical(now), now)

    def restart(self, now: int) -> None:
        """Resets as by NMT: torque off, then the boot-up message."""
        self._enter(NmtState.BOOT_UP, now)
        self.profile.restart(now)
        self.emergencies.code = 0
        self._boot(now, _EVERYTHING)

    def _boot(self, now: int, objects: tuple[int, int]) -> None:
        self.objects.reset(*objects)
        self.objects.now = now
        self.sdo.restart()
        self.emergencies.active.clear()
        self.nmt = NmtState.PRE_OPERATIONAL
        self.heartbeat.boot_up(now)
        self.profile.configure()
        self.cyclic.configure()
        self._configure_heartbeat(now)
        self._configure_consumer(now)
        self._configure_emergencies(now)
        self._listen(now)

    # Configuration.

    def _reactions(self) -> dict[int, Changed]:
        """What a stored object changes."""
        cyclic, profile = self.cyclic, self.profile

        def timing(_now: int) -> None:
            cyclic.configure_timing()

        def counting(_now: int) -> None:
            cyclic.configure_sync()

        def motion(_now: int) -> None:
            profile.configure()

        def rpdo(now: int) -> None:
            cyclic.rpdo.configure()
            self._listen(now)

        def tpdo(number: int) -> Changed:
            return lambda _now: cyclic.tpdos[number].configure()

        return {
            0x1005: self._listen, 0x1006: timing, 0x1007: timing, 0x1014: self._configure_emergencies,
            0x1015: self._configure_emergencies, 0x1016: self._configure_consumer, 0x1017: self._configure_heartbeat,
            0x1019: counting, 0x1400: rpdo, 0x1600: rpdo, 0x1800: tpdo(0), 0x1801: tpdo(1), 0x1A00: tpdo(0),
            0x1A01: tpdo(1), 0x2000: timing, 0x2002: motion, 0x6065: motion, 0x6066: motion, 0x6072: motion,
            0x6073: motion, 0x607D: motion, 0x6080: motion, 0x6081: motion, 0x60C2: motion,
        }  # fmt: skip

    def _configure_heartbeat(self, now: int) -> None:
        self.heartbeat.configure(self.objects.number(0x1017), now)

    def _configure_consumer(self, now: int) -> None:
        self._master.configure(self.objects.number(0x1016, 1))
        self.emergencies.heal(now, ErrorCode.HEARTBEAT)

    def _configure_emergencies(self, _now: int) -> None:
        self.emergencies.cob_id = self.objects.number(0x1014)
        self.emergencies.inhibit_ns = self.objects.number(0x1015) * _INHIBIT_UNIT_NS

    def _listen(self, _now: int) -> None:
        """Sets the acceptance filters."""
        self._ignore()
        self._heard = {
            NMT_COB_ID: self._on_nmt,
            self.sdo.request_id: self._on_sdo,
            self.objects.number(0x1005): self.cyclic.on_sync,
        }
        if self.cyclic.rpdo.valid:
            self._heard[self.cyclic.rpdo.cob_id] = self.cyclic.on_rpdo
        for can_id, handler in self._heard.items():
            self._port.listen(can_id, handler)

    def _ignore(self) -> None:
        for can_id, handler in self._heard.items():
            self._port.ignore(can_id, handler)
        self._heard = {}

    # Network management.

    def _on_nmt(self, data: bytes, now: int) -> None:
        command = command_for(data, self._node_id)
        if command is None:
            return
        if command is NmtCommand.RESET_NODE:
            self.restart(now)
        elif command is NmtCommand.RESET_COMMUNICATION:
            self._enter(NmtState.BOOT_UP, now)
            self._boot(now, _COMMUNICATION)
        else:
            self._enter(NEXT_STATE[command], now)

    def _enter(self, state: NmtState, now: int) -> None:
        """Leaving OPERATIONAL ends the connection to the master, which 0x6007 answers."""
        if state is self.nmt:
            return
        was_operational = self.nmt is NmtState.OPERATIONAL
        self.nmt = state
        if state is NmtState.OPERATIONAL:
            self.cyclic.start()
        elif was_operational:
            self.cyclic.stop()
            self.profile.abort_connection(now)

    def _on_sdo(self, data: bytes, now: int) -> None:
        if self.nmt in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            self.sdo.receive(data, now)

    # Errors.

    def _send_emergency(self, can_id: int, data: bytes, now: int) -> None:
        if self.nmt in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            self._port.send(can_id, data, now)

    def fault(self, code: int, now: int) -> None:
        """An error to which the drive reacts by 0x605E."""
        self.emergencies.occur(code, now)
        self.profile.fault(now)

    def _warn(self, warning: bool) -> None:
        self.profile.warning = warning

    def safe_torque_off(self, requested: bool, now: int) -> None:
        """The safety input: torque off now, without a ramp, and none until it is released."""
        self.inputs.torque_off = requested
        if requested:
            self.emergencies.occur(ErrorCode.SAFE_TORQUE_OFF, now)
            self.profile.safe_torque_off(now)
        else:
            self.emergencies.heal(now, ErrorCode.SAFE_TORQUE_OFF)

    def bus_off(self, now: int) -> None:
        """Its controller has left the bus: a communication error."""
        self._communication_error(now)

    def bus_recovered(self, now: int) -> None:
        """Its controller is back on the bus."""
        if self.nmt is not NmtState.BOOT_UP:
            self.emergencies.note(ErrorCode.BUS_OFF_RECOVERED, now)

    def _master_lost(self, now: int) -> None:
        if self.emergencies.occur(ErrorCode.HEARTBEAT, now):
            self._communication_error(now)

    def _communication_error(self, now: int) -> None:
        self.profile.abort_connection(now)
        state = _STATE_AFTER_ERROR.get(self.objects.number(0x1029, 1))
        if state is not None and self.nmt is NmtState.OPERATIONAL:
            self._enter(state, now)

    def _master_back(self, now: int) -> None:
        self.emergencies.heal(now, ErrorCode.HEARTBEAT)


def _factory(specification: DriveSpecification) -> dict[Key, int]:
    """Values in which this drive differs from the EDS."""
    return {
        (0x1018, 1): specification.vendor_id,
        (0x1018, 2): specification.product_code,
        (0x1018, 4): specification.serial,
        (0x2002, 3): specification.rated_acceleration,
        (0x608F, 1): specification.counts_per_turn,
        (0x6081, 0): min(round(specification.speed_limit), 0xFFFFFFFF),
        (0x6083, 0): specification.deceleration,
        (0x6084, 0): specification.deceleration,
        (0x6085, 0): specification.deceleration,
    }
