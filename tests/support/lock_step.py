"""The real cycle against the emulated drives in lock-step: no real clock, the same bits every time."""

import contextlib
import json
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import Phase
from axisync_schemas.internal import CONTROLLER_MESSAGE, Command, ControllerReply
from axisync_schemas.log_models import PlanLog
from axisync_schemas.memory import Control, Mailbox, TimingRing, Word, region_sizes
from axisync_schemas.plan_slots import Plan, codes_as_text
from axisync_schemas.tick_ring import TickRing, slots_for
from axisync_schemas.ticks import Records, TickLayout
from axisync_service.controller import Memory, build, open_ports
from axisync_service.motion_controller.cycle import Cycle
from axisync_service.motion_controller.plan_file import PlanFile, store
from axisync_service.motion_controller.voice import Happening


@contextlib.contextmanager
def emulated(cell_file: Path, directory: Path, faults: Sequence[Mapping[str, object]] = (),
             seed: int = 0, lock_step: bool = True) -> Iterator[None]:  # fmt: skip
    """`axisync-emulator --lock-step` for the length of a block, or in real time; it makes these faults."""
    script = directory / "faults.json"
    script.write_text(json.dumps({"seed": seed, "faults": faults}), encoding="utf-8")
    command = [sys.executable, "-m", "axisync_emulator.main", str(cell_file), "--simcan", str(directory)]
    command += ["--lock-step"] if lock_step else []
    with subprocess.Popen(
        [*command, "--candump", str(directory / "frames.log"), "--faults", str(script)],
        stdout=subprocess.PIPE, text=True,
    ) as p:  # fmt: skip
        try:
            assert p.stdout is not None
            assert p.stdout.readline().strip() == "ready"
            yield
        finally:
            p.terminate()


Steps = Generator[Command | None, ControllerReply | None, None]
"""A script: yields None to let a tick pass, or a command, and is then given its reply."""
EachTick = Callable[[Cycle, int], None]


class Script:
    """Commands the controller as front would, one command after the other, and ends with its steps.

    Attributes:
        finished: the steps are at their end.
        failure: the last refusal, if any.
    """

    leases_needed = False
    malformed = 0
    connected = True

    def __init__(self, steps: Steps) -> None:
        self.finished = False
        self.failure: str | None = None
        self._steps = steps
        self._begun = self._waiting = False
        self._reply: ControllerReply | None = None

    def poll(self) -> list[Command]:
        """Called once a tick: the next command, once the one before it was answered."""
        if self.finished or self._waiting:
            return []
        try:
            command = self._steps.send(self._reply) if self._begun else next(self._steps)
        except StopIteration:
            self.finished = True
            return []
        self._begun, self._reply, self._waiting = True, None, command is not None
        return [command] if command is not None else []

    def send(self, packet: bytes) -> None:
        """Hears what the controller says."""
        message = CONTROLLER_MESSAGE.validate_json(packet)
        if isinstance(message, ControllerReply):
            self._reply, self._waiting = message, False
            if message.error is not None:
                self.failure = message.error.message

    def close(self) -> None:
        """Nothing to close."""


@dataclass
class Run:
    """What one run left behind."""

    records: Records
    happenings: list[Happening] = field(default_factory=list)
    failure: str | None = None
    bits: tuple[float, ...] = ()
    """By bus: what the service counted for its load."""


def as_log(plan: Plan, group: str) -> PlanLog:
    """A plan as the log and plan files hold it."""
    return PlanLog(
        plan_id=plan.plan_id,
        move_id=None,
        group=group,
        axes=tuple(int(i) for i in plan.axes),
        knots=tuple(plan.knots.tolist()),
        coefficients=tuple(tuple(tuple(row) for row in segment) for segment in plan.coefficients.tolist()),
        start=tuple(plan.start.tolist()),
        end=tuple(plan.end.tolist()),
        rate_codes=codes_as_text(plan.rate_codes),
        rate_shape=plan.rate_codes.shape[1:],
        rate_limits=tuple(tuple(row) for row in plan.rate_limits.tolist()),
    )


def play(cell: Cell, plans: list[PlanLog], each_tick: EachTick = lambda *_: None) -> Run:
    """Brings the drives up, plays the plans, disables; `each_tick` is called before every tick."""
    return conduct(cell, PlanFile(plans), plans, each_tick)


def conduct(
    cell: Cell, commander: PlanFile | Script, plans: list[PlanLog], each_tick: EachTick = lambda *_: None,
    homed: Mapping[str, int] | None = None,
) -> Run:  # fmt: skip
    """Brings the drives up and does as the commander says; plan i is in slot i."""
    sizes = region_sizes(cell.period, len(cell.axes), len(cell.groups))
    layout = TickLayout(len(cell.axes), len(cell.groups))
    memory = Memory(
        control=Control(bytearray(sizes["control"]), len(cell.groups)),
        ticks=TickRing(bytearray(sizes["ticks"]), layout, slots_for(cell.period)),
        timings=TimingRing(bytearray(sizes["timings"])),
        status=Mailbox(bytearray(sizes["status"])),
        plans=bytearray(sizes["plans"]),  # type: ignore[arg-type]
    )
    store(plans, memory.plans)
    ports = open_ports(cell)
    cycle = build(cell, memory, ports, commander, None, homed)
    happenings: list[Happening] = []
    said = cycle._reporter.events

    def heard(happened: list[Happening], tick: int, now_ns: int) -> None:
        happenings.extend(happened)
        said(happened, tick, now_ns)

    cycle._reporter.events = heard  # type: ignore[method-assign,assignment]

    def phase() -> Phase:
        each_tick(cycle, memory.control[Word.CONTROLLER_TICK])
        return Phase.RUNNING

    try:
        cycle.run(phase)
    finally:
        for port in ports:
            port.close()
    newest = memory.control[Word.CONTROLLER_TICK]
    data = b"".join(record for tick in range(1, newest + 1) if (record := memory.ticks.read(tick)) is not None)
    return Run(layout.decode(data), happenings, commander.failure, tuple(port.bits for port in ports))
