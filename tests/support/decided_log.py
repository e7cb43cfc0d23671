"""Logs of what the cycle's own decisions came to, with ideal drives: whatever it can do to a move is in them."""

from pathlib import Path

import numpy as np

from axisync_schemas.internal import BeginCommand, GroupCommand, JogCommand, OverrideCommand
from axisync_schemas.memory import PLAN_SLOT_BYTES
from axisync_schemas.plan_slots import PlanReader, write_plan
from axisync_schemas.ticks import Records, TickLayout, shorten_rates
from axisync_service.motion_controller.step import Core
from axisync_service.recorder.entries import plan_fields
from support.ideal_drive import Bench
from support.plans import joint_plan
from support.saved_log import Said, at_tick, cell, event, save

ENABLE_TICKS = 60


class Decided(Bench):
    """A bench that keeps what a log would: `ticks` and `told`."""

    def __init__(self) -> None:
        self._slots = bytearray(PLAN_SLOT_BYTES)
        super().__init__(cell(), Core(cell(), lambda slot, plan_id: PlanReader(self._slots, slot, plan_id)))
        self.layout = TickLayout(len(self.cell.axes), len(self.cell.groups))
        self.ticks: list[Records] = []
        self.told: list[Said] = []
        self.run(2)
        self.tell(GroupCommand(op="enable", ref=1, group="all"))
        self.run(ENABLE_TICKS)

    def tell(self, command: object) -> None:
        """A command, and the tick that takes it."""
        self.commands = [command]
        self.run()

    def ask(self, op: str, group: str = "kingkong") -> None:
        """Hold, resume and the like."""
        self.tell(GroupCommand.model_validate({"op": op, "ref": 9, "group": group}))

    def override(self, value: float, group: str = "kingkong") -> None:
        """Another rate."""
        self.tell(OverrideCommand(ref=8, group=group, value=value))

    def move(self, group: str, plan_id: int, distance: float, jog_until_ns: int | None = None) -> None:
        """Begins a move of all the group's axes by `distance`, rad, or a jog that far at most."""
        axes = list(self.cell.axis_indices(group))
        start = self.core.current.position[axes]
        plan = joint_plan(self.cell, group, start.tolist(), (start + distance).tolist(), plan_id)
        write_plan(self._slots, 0, plan)
        fields = {"plan_id": plan_id, "move_id": f"m-{plan_id}", "group": group, **plan_fields(plan)}
        self.told.append(("/plans", self.tick, fields))
        members = len(self.cell.members(group))
        begin = BeginCommand(
            ref=2,
            group=group,
            plan_id=plan_id,
            slot=0,
            epochs=(1,) * members,
            stop_counts=(),
            jog_until_ns=jog_until_ns,
        )
        self.tell(begin)

    def jog_on(self, group: str, plan_id: int, share: float, until_ns: int) -> None:
        """Another request of a jog."""
        self.tell(JogCommand(ref=7, group=group, plan_id=plan_id, until_ns=until_ns, share=share))

    def run(self, ticks: int = 1, skipped: int = 0) -> None:
        """As of Bench, and keeps the events with their ticks."""
        for _ in range(ticks):
            known = len(self.events)
            super().run(1, skipped)
            skipped = 0
            for one in self.events[known:]:
                said = event(one.kind.value, self.tick, one.message, one.group, **one.details)
                self.told.append(("/events", self.tick, said))

    def until_rest(self, most: int = 12000) -> None:
        """Until nothing moves any more."""
        for _ in range(most):
            if not any(group.motion is not None for group in self.core.groups):
                self.run(3)
                return
            self.run()
        raise AssertionError(f"still moving after {most} ticks")

    def _record(self) -> None:
        super()._record()
        now, record = self.core.current, self.layout.new()
        record["tick"], record["cycle_start_ns"] = self.tick, at_tick(self.tick)
        for name in ("position", "velocity", "acceleration", "jerk", "plan_id", "path_s", "path_rate", "group_state"):
            record[name] = getattr(now, name)
        shorten_rates(record)
        record["target_counts"] = now.counts
        record["position_actual"] = self.core.watch.actual_position
        record["statusword"] = self.core.watch.statuswords
        self.ticks.append(record.copy())

    def save(self, directory: Path, more: list[Said] | None = None) -> Path:
        """The log."""
        return save(directory, np.array(self.ticks, dtype=self.layout.dtype), self.told + (more or []))
