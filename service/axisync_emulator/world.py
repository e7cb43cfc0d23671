"""The buses of a cell with their drives, built from the cell file and run in one process."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from axisync_emulator.candump import Candump
from axisync_emulator.drive.node import Drive
from axisync_emulator.drive.specification import specify
from axisync_emulator.faults.control import Control
from axisync_emulator.faults.injector import Injector
from axisync_emulator.faults.model import Script
from axisync_emulator.linux import StopRequest
from axisync_emulator.lock_step import run_lock_step
from axisync_emulator.real_time import run_real_time
from axisync_emulator.simcan.hub import Hub
from axisync_emulator.simcan.time_server import TimeServer
from axisync_emulator.socketcan import KernelBus, open_interface
from axisync_schemas.cell import Bus, Cell

TIME_SOCKET = "time.sock"
LOCK_STEP_START_NS = 1_000_000_000
"""Virtual time at the beginning: not 0, which on the wire means "now"."""


class WorldError(ValueError):
    """The cell cannot be emulated as asked."""


@dataclass(slots=True)
class World:
    """What runs."""

    buses: list[Hub | KernelBus]
    drives: list[Drive]
    times: TimeServer | None
    candump: Candump | None
    injector: Injector | None = None
    control: Control | None = None

    def run(self, stop: StopRequest) -> None:
        """Powers the drives on and serves until a stop is requested."""
        now = self.times.now if self.times else time.monotonic_ns()
        for drive in self.drives:
            drive.power_on(now)
        if self.times:
            run_lock_step([bus for bus in self.buses if isinstance(bus, Hub)], self.times, stop, self.control)
        else:
            run_real_time([*([self.control] if self.control else []), *self.buses], stop, self.candump)

    def close(self) -> None:
        """Frees sockets and files."""
        for bus in self.buses:
            bus.close()
        for other in (self.control, self.times, self.candump):
            if other is not None:
                other.close()

    def statistics(self) -> list[str]:
        """A line for each simcan bus and each fault: key=value."""
        hubs = ((bus, bus.medium) for bus in self.buses if isinstance(bus, Hub))
        lines = [
            f"bus={hub.name} frames={wire.frames} bits={wire.bits} load={wire.load:.4f} lost={hub.lost}"
            for hub, wire in hubs
        ]
        faults = [injected.as_dict() for injected in self.injector.injected] if self.injector else []
        return lines + [" ".join(f"{key}={value}" for key, value in fault.items()) for fault in faults]


def build(cell: Cell, names: list[str], *, lock_step: bool = False, participants: int = 1,
          candump: Path | None = None, faults: Script | None = None, control: Path | None = None) -> World:  # fmt: skip
    """The world of the named buses (all where none is named).

    Args:
        faults: what goes wrong, by a script.
        control: path of the socket that takes faults at run time.

    Raises:
        WorldError: no such bus, or lock-step on a bus that is not simcan's.
        FaultError: a fault of the script cannot be.
        BusySocket, MissingInterface, OSError: a bus or file cannot be opened.
    """
    chosen = _choose(cell, names)
    world = World([], [], None, None)
    try:
        world.candump = Candump(candump) if candump else None
        clock: Callable[[], int] = time.monotonic_ns
        if lock_step:
            times = world.times = TimeServer(_time_socket(chosen), LOCK_STEP_START_NS, participants)
            clock = lambda: times.now  # noqa: E731
        for bus in chosen:
            world.buses.append(_open(bus, world, clock))
        if faults is not None or control is not None:
            world.injector = Injector(world.buses, clock)
        _add_drives(cell, world)
        if world.injector is not None and faults is not None:
            world.injector.load(faults)
        if world.injector is not None and control is not None:
            world.control = Control(control, world.injector)
    except BaseException:
        world.close()
        raise
    return world


def _choose(cell: Cell, names: list[str]) -> list[Bus]:
    known = {bus.name: bus for bus in cell.buses}
    for name in names:
        if name not in known:
            raise WorldError(f"bus {name!r} is none of {', '.join(known)}")
    return [bus for bus in cell.buses if not names or bus.name in names]


def _time_socket(buses: list[Bus]) -> Path:
    for bus in buses:
        if bus.interface != "simcan":
            raise WorldError(f"bus {bus.name}: lock-step needs simcan, not {bus.interface} (give --simcan DIR)")
    return Path(buses[0].channel).parent / TIME_SOCKET


def _open(bus: Bus, world: World, clock: Callable[[], int]) -> Hub | KernelBus:
    if bus.interface == "socketcan":
        return KernelBus(bus.name, open_interface(bus.name, bus.channel), world.candump)
    time_socket = world.times.path if world.times else None
    return Hub(bus.name, Path(bus.channel), bus.bitrate, clock=clock, time_socket=time_socket, log=world.candump)


def _add_drives(cell: Cell, world: World) -> None:
    numbers = {bus.name: i for i, bus in enumerate(cell.buses)}
    buses = {bus.name: bus for bus in world.buses}
    for axis in sorted(cell.axes, key=lambda axis: (numbers[axis.drive.bus], axis.drive.node_id)):
        bus = buses.get(axis.drive.bus)
        if bus is not None:
            station = bus.attach()
            drive = Drive(specify(axis, numbers[axis.drive.bus]), station)
            world.drives.append(drive)
            if world.injector is not None:
                world.injector.know(bus.name, drive, station)
