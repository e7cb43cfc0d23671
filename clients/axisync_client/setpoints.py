"""The setpoint stream as numpy arrays, without decoding message by message."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_client.errors import UnexpectedReply
from axisync_schemas.cell import Cell
from axisync_schemas.ticks import Records, TickError, TickLayout


@dataclass(frozen=True, slots=True)
class Setpoints:
    """The m ticks of one batch. Axes (n) and groups (g) are in the order of the cell file.

    Attributes:
        seq: number of the batch.
        records: [m], every field of `axisync.SetpointTick`, also as attributes below; SI units.
        axes, groups: names of the columns.
    """

    seq: int
    records: Records
    axes: tuple[str, ...]
    groups: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.records)

    @property
    def tick(self) -> NDArray[np.uint64]:
        """[m] index on the grid."""
        return self.records["tick"]

    @property
    def time_s(self) -> NDArray[np.float64]:
        """[m] instant of the tick on the daemon's monotonic clock, s."""
        seconds: NDArray[np.float64] = self.records["cycle_start_ns"] * 1e-9
        return seconds

    @property
    def skipped(self) -> NDArray[np.bool_]:
        """[m] nothing was sent at this tick."""
        flags: NDArray[np.bool_] = self.records["skipped"] != 0
        return flags

    @property
    def position(self) -> NDArray[np.float64]:
        """[m, n] setpoint in force, rad."""
        return self.records["position"]

    @property
    def velocity(self) -> NDArray[np.float64]:
        """[m, n] rad/s."""
        return self.records["velocity"]

    @property
    def acceleration(self) -> NDArray[np.float64]:
        """[m, n] rad/s^2."""
        return self.records["acceleration"]

    @property
    def jerk(self) -> NDArray[np.float64]:
        """[m, n] rad/s^3."""
        return self.records["jerk"]

    @property
    def position_actual(self) -> NDArray[np.float64]:
        """[m, n] newest sample known at the tick, rad."""
        return self.records["position_actual"]

    def columns(self, group: str, cell: Cell) -> list[int]:
        """Columns of a group or compound, for use as `batch.position[:, columns]`."""
        return list(cell.axis_indices(group))


def decoder(cell: Cell) -> Callable[[bytes], tuple[Setpoints, int]]:
    """Reads the batches of this cell.

    Raises (the decoder):
        UnexpectedReply: a batch of another cell's layout.
    """
    layout = TickLayout(len(cell.axes), len(cell.groups))
    axes = tuple(axis.name for axis in cell.axes)

    def decode(payload: bytes) -> tuple[Setpoints, int]:
        try:
            records, seq = layout.unbatch(payload)
        except TickError as error:
            raise UnexpectedReply(
                f"the daemon's setpoints cannot be read ({error})", "it has another cell file now: connect again"
            ) from None
        return Setpoints(seq, records, axes, cell.group_names), seq

    return decode
