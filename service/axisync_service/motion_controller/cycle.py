"""The loop: wait for the tick, SYNC, read, decide, write, record. Every way out of it stops the drives."""

import gc
import resource
import time
from collections.abc import Callable, Iterator

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import NmtState, Phase
from axisync_schemas.events import EventKind
from axisync_schemas.memory import Control, GroupWord, Mailbox, TimingRing, Word
from axisync_service.bus.port import BusPort, Frame
from axisync_service.canopen import sync
from axisync_service.canopen.nmt import HEARTBEAT_BASE, NMT_ID, make_command, make_heartbeat
from axisync_service.canopen.pdo import RPDO1_BASE, make_rpdo1
from axisync_service.canopen.sdo import REQUEST_BASE
from axisync_service.drives.cia402 import Controlword
from axisync_service.drives.link import DriveLink
from axisync_service.motion_controller.clock import GridClock, Tick
from axisync_service.motion_controller.demand import Inputs
from axisync_service.motion_controller.dispatch import dispatch_tables
from axisync_service.motion_controller.groups import GroupMachine
from axisync_service.motion_controller.lateness import Lateness, Spent
from axisync_service.motion_controller.reporter import Commander, Reporter, TickWriter
from axisync_service.motion_controller.skips import SkipReport
from axisync_service.motion_controller.status import StatusWriter
from axisync_service.motion_controller.step import Core
from axisync_service.motion_controller.voice import Happening, Severity

STATUS_PERIOD_S = 0.05
SDO_FRAMES_IDLE = 4
"""SDO requests per bus and tick while no drive of the cell is enabled; one every second tick while any is: with its
response that is the one SDO frame a tick that the bus budget has room for."""
GARBAGE_PERIOD_S = 1.0
OLD_GARBAGE_EVERY = 60
"""Of so many collections one looks at everything: what survives one is not looked at by the others any more."""
FAREWELL_ROUNDS = 3


class Cycle:
    """Wires the pure core to buses, shared memory and sockets, and runs it tick by tick."""

    def __init__(
        self,
        cell: Cell,
        core: Core,
        ports: list[BusPort],
        clock: GridClock,
        control: Control,
        commander: Commander,
        reporter: Reporter,
        status: Mailbox,
        ticks: TickWriter,
        timings: TimingRing,
    ) -> None:
        self.cell, self.core, self.ports, self.clock, self.control = cell, core, ports, clock, control
        self._commander, self._reporter, self._ticks, self._timings = commander, reporter, ticks, timings
        self._tables = dispatch_tables(cell, core.drives)
        self._drives_of_bus = [
            [(group, axis, drive) for group in core.groups for axis, drive in enumerate(group.drives)
             if drive.axis.drive.bus == bus.name]
            for bus in cell.buses
        ]  # fmt: skip
        self._heartbeat_ticks = max(1, round(cell.controller_heartbeat / cell.period))
        self._status_ticks = max(1, round(STATUS_PERIOD_S / cell.period))
        self._status = StatusWriter(status, core.drives, self._status_ticks)
        self._garbage_ticks = max(1, round(GARBAGE_PERIOD_S / cell.period))
        self._sdo_turn = [0] * len(ports)
        self._skipped_ticks = 0
        self._skips = SkipReport(self._garbage_ticks)
        self._lateness = Lateness(cell.period_ns)
        self._bits_before = [0.0] * len(ports)
        self._loads = [0.0] * len(ports)
        self._off = [False] * len(ports)
        self._front = False
        self._malformed = 0
        self.phase = Phase.RUNNING

    def run(self, phase_of: Callable[[], Phase]) -> None:
        """Runs until the service stops and the drives are off. On an exception the drives are told to quick stop."""
        self.clock.start()
        try:
            while not self.core.shut_down:
                self.phase = phase_of()
                self.tick(self.clock.wait())
        except BaseException as error:
            self._reporter.events(
                [Happening(EventKind.CYCLE_FAILED, f"the cycle failed: {error!r}", None, "error")],
                self.control[Word.CONTROLLER_TICK],
                self.clock.source.now_ns(),
            )
            raise
        finally:
            self._farewell()
            self.control[Word.CONTROLLER_DONE] = 1

    def tick(self, tick: Tick) -> None:
        """One executed tick, and the records of those skipped before it."""
        now = time.monotonic_ns
        sync_frame = [(sync.SYNC_ID, sync.FRAMES[sync.counter(tick.index)])]
        switches, began = _switches(), now()
        for port in self.ports:
            port.send(sync_frame)
        for missed in range(tick.index - tick.skipped, tick.index):
            self._skip(missed, tick)
        self.core.begin_tick()
        self._read(tick.start_ns)
        commands = self._commander.poll()
        read = now()
        self.core.step(self._inputs(tick), commands)
        decided = now()
        self._write(tick)
        written = now()
        self._ticks.write(tick.index, tick.due_ns, tick.lateness_ns, False, self.core.current, self.core)
        self.control[Word.CONTROLLER_TICK] = tick.index
        cause = self._lateness.judge(tick)
        self._report(tick)
        recorded = now()
        spent = Spent(read - began, decided - read, written - decided, recorded - written, _switches() != switches)
        self._timings.write(
            tick.index, tick.lateness_ns, spent.read, spent.decide, spent.write, spent.record, tick.skipped, cause
        )
        self.control[Word.CONTROLLER_NS] = time.monotonic_ns()
        self._lateness.note(spent)
        if tick.index % self._garbage_ticks == 0 and self.core.still:
            gc.collect(2 if tick.index // self._garbage_ticks % OLD_GARBAGE_EVERY == 0 else 1)

    def _skip(self, index: int, tick: Tick) -> None:
        self.core.begin_tick()
        due = self.clock.due_ns(index)
        self._ticks.write(index, due, tick.start_ns - due, True, self.core.current, self.core)
        self.control[Word.CONTROLLER_TICK] = index
        self.core.advance_skipped()
        self._skipped_ticks += 1

    # --- read ---------------------------------------------------------------------------------------------------

    def _read(self, now_ns: int) -> None:
        foreign = self.core.foreign
        for bus, (port, table) in enumerate(zip(self.ports, self._tables, strict=True)):
            for can_id, data in port.drain():
                handler = table.get(can_id)
                if handler is not None:
                    handler(data, now_ns)
                else:
                    foreign.hear(bus, can_id)

    def _inputs(self, tick: Tick) -> Inputs:
        control = self.control
        connected = self._commander.connected
        if connected != self._front:
            self._front = connected
            kind = EventKind.FRONT_CONNECTED if connected else EventKind.FRONT_LOST
            self.core.voice.say(kind, kind.value.replace("_", " "), None)
        return Inputs(
            tick=tick.index,
            now_ns=tick.start_ns,
            skipped=tick.skipped,
            stop_counts=control.of_groups(GroupWord.STOP_COUNT),
            lease_until_ns=control.of_groups(GroupWord.LEASE_UNTIL_NS),
            lease_epochs=control.of_groups(GroupWord.LEASE_EPOCH),
            front=connected,
            leases_needed=self._commander.leases_needed,
            stopping=self.phase is not Phase.RUNNING or self._commander.finished,
        )

    # --- write --------------------------------------------------------------------------------------------------

    def _write(self, tick: Tick) -> None:
        counts = self.core.upcoming.counts.tolist()
        enabled = any(group.following for group in self.core.groups)
        for position, port in enumerate(self.ports):
            drives = self._drives_of_bus[position]
            frames = [
                (
                    RPDO1_BASE + drive.axis.drive.node_id,
                    make_rpdo1(group.controlword(axis, tick.index), counts[group.first + axis]),
                )
                for group, axis, drive in drives
                if drive.bring_up.ready
            ]
            frames += self._rest(position, drives, tick, (tick.index & 1) if enabled else SDO_FRAMES_IDLE)
            port.send(frames)

    def _rest(
        self, position: int, drives: list[tuple[GroupMachine, int, DriveLink]], tick: Tick, sdo: int
    ) -> Iterator[Frame]:
        """Heartbeat, NMT and, last, SDO."""
        if tick.index % self._heartbeat_ticks == 0:
            yield HEARTBEAT_BASE + self.cell.controller_node_id, make_heartbeat(NmtState.OPERATIONAL)
        for _, _, drive in drives:
            command = drive.bring_up.command
            if command is not None:
                drive.bring_up.command = None
                yield NMT_ID, make_command(command, drive.axis.drive.node_id)
        turn = self._sdo_turn[position]
        for offset in range(len(drives)):
            if sdo == 0:
                break
            drive = drives[(turn + offset) % len(drives)][2]
            frame = drive.bring_up.sdo.poll(tick.start_ns)
            if frame is not None:
                sdo -= 1
                self._sdo_turn[position] = (turn + offset + 1) % len(drives)
                yield REQUEST_BASE + drive.axis.drive.node_id, frame

    # --- report -------------------------------------------------------------------------------------------------

    def _report(self, tick: Tick) -> None:
        core = self.core
        self._skips.add(tick)
        if self._skips.due(tick.index):
            self._skips.say(core.voice)
        if self._lateness.due(tick.index):
            self._lateness.say(tick.index, core.voice)
        if core.voice.replies:
            for ref, error in core.voice.replies:
                self._reporter.reply(ref, tick.index, error, core.voice.data.pop(ref, None))
            core.voice.replies.clear()
        if core.voice.happenings or core.voice.changed:
            self._status.renew()
            self._reporter.events(core.voice.happenings, tick.index, tick.start_ns)
        if core.voice.changed or tick.index % self._status_ticks == 0:
            self._say_buses()
            self._say_malformed()
            self._status.write(core, self.ports, self._loads, tick.index, tick.start_ns, self._skipped_ticks)
            self.control[Word.HOMED_CHANGES] = core.homed_changes
        else:
            self._status.look()
        if tick.index % self._garbage_ticks == 0:
            self._measure_loads()

    def _say_malformed(self) -> None:
        """Front sent what is no command: it was passed over."""
        count = self._commander.malformed - self._malformed
        if count:
            self._malformed += count
            text = f"{count} packets from front were no commands"
            self.core.voice.say(EventKind.COMMANDS_MALFORMED, text, None, "error", count=count)

    def _say_buses(self) -> None:
        """A bus that went off, or is back."""
        for position, port in enumerate(self.ports):
            if port.off != self._off[position]:
                self._off[position] = port.off
                text = f"bus {port.bus.name} is {port.failure if port.off else 'back from bus-off'}"
                severity: Severity = "error" if port.off else "info"
                self.core.voice.say(EventKind.BUS_FAILED, text, None, severity, bus=port.bus.name)

    def _measure_loads(self) -> None:
        """Share of a second's bits in frames heard and sent, with the usual stuffing."""
        seconds = self._garbage_ticks * self.cell.period
        for position, port in enumerate(self.ports):
            self._loads[position] = (port.bits - self._bits_before[position]) / (port.bus.bitrate * seconds)
            self._bits_before[position] = port.bits

    # --- end ----------------------------------------------------------------------------------------------------

    def _farewell(self) -> None:
        """Whatever happened: no drive keeps torque because of us. A drive that is off already ignores it."""
        targets = self.core.current.counts.tolist()
        for _ in range(FAREWELL_ROUNDS):
            for position, port in enumerate(self.ports):
                port.send(
                    [
                        (
                            RPDO1_BASE + drive.axis.drive.node_id,
                            make_rpdo1(Controlword.QUICK_STOP, targets[group.first + axis]),
                        )
                        for group, axis, drive in self._drives_of_bus[position]
                        if drive.bring_up.ready and group.following
                    ]
                )
            tick = self.clock.wait()
            for port in self.ports:
                port.send([(sync.SYNC_ID, sync.FRAMES[sync.counter(tick.index)])])


def _switches() -> int:
    """How often the processor was taken from this thread."""
    return resource.getrusage(resource.RUSAGE_THREAD).ru_nivcsw
