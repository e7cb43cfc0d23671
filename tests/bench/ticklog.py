"""What the log says of a run: when the setpoints of each move came into force."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.ticks import Records
from support.logread import read_log

Condition = Callable[[Records], NDArray[np.bool_]]


@dataclass(frozen=True, slots=True)
class TickLog:
    """Records of every tick, in order; plan ids by move id."""

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
        return self._first(move_id, lambda ticks: ticks["path_s"] > 0.0, "setpoint")

    def first_slowed_ns(self, move_id: str) -> int:
        """Instant at which the move's first slowed setpoint came into force: t of that tick.

        Raises:
            LookupError: the log has none.
        """
        return self._first(move_id, lambda ticks: ticks["path_rate"] < 1.0, "slowed setpoint")

    def _first(self, move_id: str, wanted: Condition, what: str) -> int:
        if move_id not in self.plans:
            raise LookupError(f"the log has no plan of move {move_id}")
        mine = self.ticks["plan_id"] == self.plans[move_id]
        rows = np.flatnonzero((mine & wanted(self.ticks)).any(axis=1))
        if rows.size == 0:
            raise LookupError(f"the log has no {what} of move {move_id}")
        return int(self.ticks["cycle_start_ns"][rows[0]])


def read(paths: Sequence[Path]) -> TickLog:
    """The whole log, of one or more files.

    Raises:
        ValueError: ticks are missing in it.
    """
    log = read_log(*paths)
    gaps = np.flatnonzero(np.diff(log.ticks["tick"].astype(np.int64)) != 1)
    if gaps.size:
        raise ValueError(f"{paths[0]}: the log lacks ticks after tick {log.ticks['tick'][gaps[0]]}")
    return TickLog(log.ticks, {str(plan["move_id"]): plan_id for plan_id, plan in log.plans.items()})
