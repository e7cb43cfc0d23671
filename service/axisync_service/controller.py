"""The controller process: real time, one thread, no zenoh, no log file. Started by the supervisor."""

import mmap
import socket
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from axisync_schemas.cell import Cell
from axisync_schemas.events import EventKind
from axisync_schemas.memory import Control, Mailbox, TimingRing, Word
from axisync_schemas.plan_slots import PlanReader
from axisync_schemas.tick_ring import TickRing, slots_for
from axisync_schemas.ticks import TickLayout
from axisync_service import process
from axisync_service.bus.port import BusError, BusPort, open_port
from axisync_service.canopen.budget import budget
from axisync_service.daemon.homed import HomedFile
from axisync_service.motion_controller import realtime
from axisync_service.motion_controller.clock import GridClock, MonotonicTime, TimeSource
from axisync_service.motion_controller.cycle import Cycle
from axisync_service.motion_controller.front_link import FrontLink
from axisync_service.motion_controller.reporter import Commander, Reporter, TickWriter
from axisync_service.motion_controller.step import Core
from axisync_service.motion_controller.voice import Happening


@dataclass(frozen=True, slots=True)
class Memory:
    """Shared memory of the controller, mapped."""

    control: Control
    ticks: TickRing
    timings: TimingRing
    status: Mailbox
    plans: mmap.mmap


def build(
    cell: Cell, memory: Memory, ports: list[BusPort], commander: Commander, log: socket.socket | None,
    homed: Mapping[str, int] | None = None,
) -> Cycle:  # fmt: skip
    """Constructs the loop from its parts; `homed`: axes that an earlier run homed, and their drives' serial numbers."""
    core = Core(cell, lambda slot, plan_id: PlanReader(memory.plans, slot, plan_id), homed)
    source: TimeSource = next((port.time_source for port in ports if port.time_source), None) or MonotonicTime()
    worst = max(budget(cell, bus).cyclic_s for bus in cell.buses)
    clock = GridClock(source, cell.period_ns, round(worst * 1e9))
    reporter = Reporter(commander, log)
    writer = TickWriter(memory.ticks)
    return Cycle(cell, core, ports, clock, memory.control, commander, reporter, memory.status, writer, memory.timings)


def open_ports(cell: Cell) -> list[BusPort]:
    """All buses of the cell.

    Raises:
        BusError: one of them cannot be opened.
    """
    return [open_port(bus) for bus in cell.buses]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs until the service stops."""
    context = process.start("controller", arguments)
    cell, regions = context.cell, context.regions
    memory = Memory(
        control=context.control,
        ticks=TickRing(regions["ticks"].map(), TickLayout(len(cell.axes), len(cell.groups)), slots_for(cell.period)),
        timings=TimingRing(regions["timings"].map()),
        status=Mailbox(regions["status"].map()),
        plans=regions["plans"].map(writable=False),
    )
    try:
        ports = open_ports(cell)
    except BusError as error:
        print(f"axisyncd: {error}", file=sys.stderr)
        return process.EXIT_CONFIGURATION
    commander = FrontLink(socket.socket(fileno=context.sockets["controller_listen"]))
    log = socket.socket(fileno=context.sockets["log"])
    cycle = build(cell, memory, ports, commander, log, HomedFile(cell).read())
    continue_grid(cycle, memory.control)
    enter_realtime(cycle.core, memory.control)
    try:
        cycle.run(context.phase)
    finally:
        commander.close()
        for port in ports:
            port.close()
    return 0


def continue_grid(cycle: Cycle, control: Control) -> None:
    """A restarted controller numbers its ticks on from the last one, so that the log has no tick twice."""
    cycle.clock.first = control[Word.CONTROLLER_TICK] + 1
    control[Word.CONTROLLER_DONE] = 0


def enter_realtime(core: Core, control: Control) -> None:
    """Real-time scheduling where permitted; one plain warning where not."""
    missing = realtime.enter()
    control[Word.REALTIME] = int(missing is None)
    if missing is not None:
        text = f"the cycle may be late: no permission for {missing}; see deploy/realtime.md"
        core.voice.happenings.append(Happening(EventKind.REALTIME, text, None, "warning"))
        print(f"axisyncd: {text}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
