"""What the log says of a run: the ticks as arrays, and which plan a move became."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from numpy.typing import NDArray

from axisync_schemas.cell import Cell
from axisync_schemas.ticks import Records, TickLayout
from axisync_schemas.topics import LOG_PLANS, LOG_SETPOINTS

Condition = Callable[[Records], NDArray[np.bool_]]


@dataclass(frozen=True, slots=True)
class Log:
    """Records of every tick, sorted; plan ids by move id."""

    ticks: Records
    plans: dict[str, int]

    def between(self, first_ns: int, last_ns: int) -> Records:
        """Ticks of a span of the monotonic clock."""
        begins = self.ticks["cycle_start_ns"]
        return self.ticks[(begins >= first_ns) & (begins < last_ns)]

    def first_setpoint_ns(self, move_id: str) -> int:
        """Instant at which the move's first setpoint off its start came into force: t of that tick.

        Raises:
            LookupError: the log has none.
        """
        return self._first(move_id, lambda part: part["path_s"] > 0.0, "setpoint")

    def first_slowed_ns(self, move_id: str) -> int:
        """Instant at which the move's first slowed setpoint came into force: t of that tick.

        Raises:
            LookupError: the log has none.
        """
        return self._first(move_id, lambda part: part["path_rate"] < 1.0, "slowed setpoint")

    def _first(self, move_id: str, wanted: Condition, what: str) -> int:
        mine = self.ticks["plan_id"] == self.plans[move_id]
        rows = np.flatnonzero((mine & wanted(self.ticks)).any(axis=1))
        if rows.size == 0:
            raise LookupError(f"the log has no {what} of move {move_id}")
        return int(self.ticks["cycle_start_ns"][rows[0]])


def read(path: Path, cell: Cell) -> Log:
    """The whole log.

    Raises:
        ValueError: ticks are missing in it.
    """
    layout = TickLayout(len(cell.axes), len(cell.groups))
    records, plans = [], {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=[LOG_SETPOINTS, LOG_PLANS]):
            if channel.topic == LOG_SETPOINTS:
                records.append(message.data)
            else:
                plan = json.loads(message.data)
                plans[plan["move_id"]] = int(plan["plan_id"])
    ticks = layout.decode(b"".join(records))
    _, kept = np.unique(ticks["tick"], return_index=True)  # a restarted recorder may write a tick twice
    ticks = ticks[kept]
    gaps = np.flatnonzero(np.diff(ticks["tick"].astype(np.int64)) != 1)
    if gaps.size:
        raise ValueError(f"{path}: the log lacks ticks after tick {ticks['tick'][gaps[0]]}")
    return Log(ticks, plans)
