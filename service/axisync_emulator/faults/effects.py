"""What each kind of fault does when it begins, and how it is undone."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from axisync_emulator.drive.emergency import SELF_HEALING
from axisync_emulator.drive.health import Quantity
from axisync_emulator.drive.inputs import Input
from axisync_emulator.drive.node import Drive
from axisync_emulator.drive.object_dictionary import Key, Reader
from axisync_emulator.drive.options import Mode
from axisync_emulator.drive.process_data import integer32
from axisync_emulator.faults import model
from axisync_emulator.faults.model import NodeFault
from axisync_emulator.segment import Matches, Station, every

_POSITION, _VELOCITY = (0x6064, 0), (0x606C, 0)
_TWIN_SERIAL = 0x8000
_IDENTITY = ("vendor_id", "product_code", "revision", "serial")


@dataclass(frozen=True, slots=True)
class Node:
    """A drive and its place on a bus. `attach` gives another place on the same bus."""

    drive: Drive
    station: Station
    attach: Callable[[], Station]


class Effect(Protocol):
    """A fault at work."""

    def begin(self, now: int) -> None:
        """It happens."""

    def end(self, now: int) -> None:
        """It is over."""


@dataclass(slots=True)
class Pair:
    """An effect of two functions."""

    begin: Callable[[int], None]
    end: Callable[[int], None]


def _nothing(_now: int) -> None:
    """What happened cannot be undone, or undoes itself."""


def effect_in(node: Node, fault: NodeFault) -> Effect:
    """The effect of a fault in one drive."""
    make: Callable[..., Effect] = _EFFECTS[type(fault)]
    return make(node, fault)


def _meant(can_id: int | None) -> Matches:
    return every if can_id is None else lambda other: other == can_id


def _mute(node: Node, fault: model.Mute) -> Effect:
    meant = _meant(fault.id)
    return Pair(lambda _now: node.station.mute(meant), lambda _now: node.station.speak(meant))


def _deaf(node: Node, fault: model.Deaf) -> Effect:
    meant = _meant(fault.id)
    return Pair(lambda _now: node.station.deafen(meant), lambda _now: node.station.hear(meant))


def _power_cycle(node: Node, fault: model.PowerCycle) -> Effect:
    def on(now: int) -> None:
        if fault.encoder == "incremental":
            node.drive.lose_position(now)
        node.drive.power_on(now)

    return Pair(node.drive.power_off, on)


def _reset(node: Node, _fault: model.Reset) -> Effect:
    return Pair(node.drive.restart, _nothing)


class _Measured:
    """Other readers for measured quantities, while it lasts; PDOs look them up anew."""

    def __init__(self, drive: Drive, replace: Callable[[Reader, int], Reader], keys: tuple[Key, ...]) -> None:
        self._drive = drive
        self._replace = replace
        self._keys = keys
        self._before: dict[Key, Reader] = {}

    def begin(self, now: int) -> None:
        """See `Effect`."""
        readers = self._drive.objects.readers
        self._before = {key: readers[key] for key in self._keys}
        readers.update({key: self._replace(reader, now) for key, reader in self._before.items()})
        self._bind()

    def end(self, _now: int) -> None:
        """See `Effect`."""
        self._drive.objects.readers.update(self._before)
        self._bind()

    def _bind(self) -> None:
        for tpdo in self._drive.cyclic.tpdos:
            tpdo.bind()


def _constant(value: int) -> Reader:
    return lambda _now: value


def _freeze(node: Node, _fault: model.Freeze) -> Effect:
    return _Measured(node.drive, lambda reader, now: _constant(reader(now)), (_POSITION, _VELOCITY))


def _jump(node: Node, fault: model.Jump) -> Effect:
    def shifted(reader: Reader, _now: int) -> Reader:
        return lambda now: integer32(reader(now) + fault.counts)

    return _Measured(node.drive, shifted, (_POSITION,))


def _identity(node: Node, fault: model.WrongIdentity) -> Effect:
    readers = node.drive.objects.readers
    values = {(0x1018, sub): getattr(fault, name) for sub, name in enumerate(_IDENTITY, 1)}

    def begin(_now: int) -> None:
        readers.update({key: _constant(value) for key, value in values.items() if value is not None})

    def end(_now: int) -> None:
        for key in values:
            readers.pop(key, None)

    return Pair(begin, end)


def _emergency(node: Node, fault: model.Emergency) -> Effect:
    drive = node.drive

    def begin(now: int) -> None:
        if fault.warning:
            drive.emergencies.occur(fault.code, now)
        else:
            drive.fault(fault.code, now)

    def end(now: int) -> None:
        if fault.warning or fault.code in SELF_HEALING:  # its cause has gone
            drive.emergencies.heal(now, fault.code)

    return Pair(begin, end)


def _no_heartbeat(node: Node, _fault: model.NoHeartbeat) -> Effect:
    def silence(silent: bool) -> Callable[[int], None]:
        return lambda _now: setattr(node.drive.heartbeat, "silent", silent)

    return Pair(silence(True), silence(False))


def _sdo(node: Node, fault: model.SdoFault) -> Effect:
    faults, key = node.drive.sdo.faults, (fault.index, fault.sub)

    def begin(_now: int) -> None:
        faults[key] = fault.abort

    def end(_now: int) -> None:
        faults.pop(key, None)

    return Pair(begin, end)


def _drift(node: Node, fault: model.Drift) -> Effect:
    stretch = 1.0 / (1.0 + fault.ppm * 1e-6)
    return Pair(lambda _now: node.station.drift(stretch), lambda _now: node.station.drift(1.0))


def _safe_torque_off(node: Node, _fault: model.SafeTorqueOff) -> Effect:
    cut = node.drive.safe_torque_off
    return Pair(lambda now: cut(True, now), lambda now: cut(False, now))


def _temperature(node: Node, fault: model.Temperature) -> Effect:
    return _driven(node, node.drive.health.temperature, fault.celsius, fault.per_s)


def _voltage(node: Node, fault: model.Voltage) -> Effect:
    return _driven(node, node.drive.health.voltage, fault.volts, fault.per_s)


def _driven(node: Node, quantity: Quantity, goal: float, per_s: float | None) -> Effect:
    health, normal = node.drive.health, quantity.value
    return Pair(
        lambda now: health.drive(quantity, goal, per_s, now), lambda now: health.drive(quantity, normal, per_s, now)
    )


def _jam(node: Node, _fault: model.Jam) -> Effect:
    def jam(jammed: bool) -> Callable[[int], None]:
        def act(now: int) -> None:
            node.drive.motor.advance(now)
            node.drive.motor.jammed = jammed

        return act

    return Pair(jam(True), jam(False))


def _leave_mode(node: Node, _fault: model.LeaveMode) -> Effect:
    return Pair(lambda now: node.drive.profile.set_mode(Mode.NONE, now), _nothing)


def _input(node: Node, fault: model.StuckInput) -> Effect:
    forced, switch = node.drive.inputs.forced, Input[fault.input.upper()]

    def begin(_now: int) -> None:
        forced[switch] = fault.active

    def end(_now: int) -> None:
        forced.pop(switch, None)

    return Pair(begin, end)


def _twin(node: Node, _fault: model.Twin) -> Effect:
    specification = node.drive.specification
    other = dataclasses.replace(specification, serial=specification.serial ^ _TWIN_SERIAL)
    twin = Drive(other, node.attach())
    return Pair(twin.power_on, twin.power_off)


_EFFECTS: dict[type[NodeFault], Callable[..., Effect]] = {
    model.Mute: _mute,
    model.Deaf: _deaf,
    model.PowerCycle: _power_cycle,
    model.Reset: _reset,
    model.Freeze: _freeze,
    model.Jump: _jump,
    model.WrongIdentity: _identity,
    model.Emergency: _emergency,
    model.NoHeartbeat: _no_heartbeat,
    model.SdoFault: _sdo,
    model.Drift: _drift,
    model.SafeTorqueOff: _safe_torque_off,
    model.Temperature: _temperature,
    model.Voltage: _voltage,
    model.Jam: _jam,
    model.LeaveMode: _leave_mode,
    model.StuckInput: _input,
    model.Twin: _twin,
}
