"""The real cycle against the emulated drives in lock-step: no real clock, the same bits every time."""

import contextlib
import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from axisync_schemas.cell import Cell
from axisync_schemas.enumerations import Phase
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
             seed: int = 0) -> Iterator[None]:  # fmt: skip
    """`axisync-emulator --lock-step` for the length of a block; it makes these faults."""
    script = directory / "faults.json"
    script.write_text(json.dumps({"seed": seed, "faults": faults}), encoding="utf-8")
    command = [sys.executable, "-m", "axisync_emulator.main", str(cell_file), "--simcan", str(directory), "--lock-step"]
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


@dataclass
class Run:
    """What one run left behind."""

    records: Records
    happenings: list[Happening] = field(default_factory=list)
    failure: str | None = None


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


def play(cell: Cell, plans: list[PlanLog], each_tick: Callable[[Cycle, int], None] = lambda *_: None) -> Run:
    """Brings the drives up, plays the plans, disables; `each_tick` is called before every tick."""
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
    commander = PlanFile(plans)
    cycle = build(cell, memory, ports, commander, None)
    happenings: list[Happening] = []
    said = cycle._reporter.events
    cycle._reporter.events = lambda list_, *rest: (happenings.extend(list_), said(list_, *rest))[1]  # type: ignore[method-assign]

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
    return Run(layout.decode(data), happenings, commander.failure)
