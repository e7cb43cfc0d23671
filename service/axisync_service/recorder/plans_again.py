"""Plans that are being played when a recorder starts: their messages went to the one before, their slots are there."""

import mmap
import struct

from axisync_schemas.cell import Cell
from axisync_schemas.memory import PLAN_SLOTS
from axisync_schemas.plan_slots import Plan, PlanError, read_plan
from axisync_schemas.tick_ring import TickRing
from axisync_schemas.topics import LOG_PLANS
from axisync_service.actioner.moves import move_id_of
from axisync_service.recorder.entries import Message, message, plan_fields


def plans_in(ring: TickRing, cell: Cell, first: int, last: int) -> dict[int, str]:
    """Ids of the plans that ticks first..last are played from, each with the group that plays it."""
    code, offset = struct.Struct(f"<{len(cell.groups)}Q"), ring.layout.offset("plan_id")
    players: dict[int, set[int]] = {}
    for tick in range(max(first, last - ring.slots + 1), last + 1):
        record = ring.read(tick)
        if record is not None:
            for group, plan_id in enumerate(code.unpack_from(record, offset)):
                players.setdefault(plan_id, set()).add(group)
    players.pop(0, None)
    return {plan_id: _name(cell, tuple(sorted(groups))) for plan_id, groups in players.items()}


def _name(cell: Cell, groups: tuple[int, ...]) -> str:
    for compound in cell.compounds:
        if cell.members(compound.name) == groups:
            return compound.name
    return cell.group_names[groups[0]]


def recovered(plans: mmap.mmap | bytearray, playing: dict[int, str], log_time_ns: int) -> list[Message]:
    """A `/plans` message of each that is still in a slot: its polynomials, but not what was asked."""
    found = []
    for plan_id, group in sorted(playing.items()):
        plan = _find(plans, plan_id)
        if plan is not None:
            head = {"plan_id": plan_id, "move_id": move_id_of(plan_id), "group": group}
            found.append(message(LOG_PLANS, log_time_ns, {**head, **plan_fields(plan)}))
    return found


def _find(plans: mmap.mmap | bytearray, plan_id: int) -> Plan | None:
    for slot in range(PLAN_SLOTS):
        try:
            return read_plan(plans, slot, plan_id)
        except PlanError:
            continue
        except struct.error:  # Beyond the end of the region.
            return None
    return None
