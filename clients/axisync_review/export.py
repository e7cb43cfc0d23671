"""A log as a table for other programs: one row a tick, column names with their units, as Parquet or CSV."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from axisync_review.errors import MissingExtra, NotWritten
from axisync_review.pieces import Piece, Progress, Run
from axisync_schemas.cell import Cell

PER_AXIS = {
    "position": "position_rad",
    "velocity": "velocity_rad_s",
    "acceleration": "acceleration_rad_s2",
    "jerk": "jerk_rad_s3",
    "target_counts": "target_counts",
    "position_actual": "position_actual_rad",
    "statusword": "statusword",
}
PER_GROUP = {"plan_id": "plan_id", "path_s": "path_s", "path_rate": "path_rate", "group_state": "state"}
"""Fields of a tick, and what their columns are called behind `<axis>.` or `<group>.`."""

Columns = dict[str, NDArray[Any]]


def columns(cell: Cell, piece: Piece, begin_ns: int) -> Columns:
    """The new rows: time, tick, then axis by axis and group by group."""
    found: Columns = {
        "time_s": (piece.fresh("log_time").astype(np.int64) - begin_ns) / 1e9,
        "wall_time_ns": piece.fresh("log_time"),
        "tick": piece.fresh("tick"),
        "cycle_start_ns": piece.fresh("cycle_start_ns"),
        "lateness_ns": piece.fresh("lateness_ns"),
        "skipped": piece.fresh("skipped"),
    }
    for names, fields in (
        ([axis.name for axis in cell.axes], PER_AXIS),
        (cell.group_names, PER_GROUP),
    ):
        for index, name in enumerate(names):
            for field, column in fields.items():
                found[f"{name}.{column}"] = np.ascontiguousarray(piece.fresh(field)[:, index])
    return found


class Sink(Protocol):
    """Where rows go."""

    def write(self, rows: Columns) -> None: ...


def export(
    paths: Sequence[Path],
    out: Path,
    sink: Callable[[Path], AbstractContextManager[Sink]],
    progress: Progress | None = None,
) -> int:
    """Writes all ticks to `out`, which appears under its name when it is whole; how many.

    Raises:
        LogUnreadable: see `Run`.
        NotWritten: `out` exists or cannot be written.
    """
    run, begin_ns, part_of = Run(paths, progress), None, out.with_name(out.name + ".part")
    if out.exists():
        raise NotWritten(f"{out} exists already", "name another file with -o")
    try:
        with sink(part_of) as table:
            for part in run.parts():
                if isinstance(part, Piece):
                    begin_ns = int(part.fresh("log_time")[0]) if begin_ns is None else begin_ns
                    table.write(columns(run.cell, part, begin_ns))
        part_of.rename(out)
    except OSError as error:
        part_of.unlink(missing_ok=True)
        raise NotWritten(f"{out} cannot be written: {error.strerror or error}") from None
    except BaseException:
        part_of.unlink(missing_ok=True)
        raise
    return run.ticks


class CsvSink:
    """Comma-separated, a head line, floats in the shortest form that reads back exactly."""

    def __init__(self, path: Path) -> None:
        self._stream = path.open("x", encoding="ascii", newline="")
        self._head = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stream.close()

    def write(self, rows: Columns) -> None:
        """Adds rows."""
        if not self._head:
            self._stream.write(",".join(rows) + "\n")
            self._head = True
        texts = [map(repr, values.tolist()) for values in rows.values()]
        self._stream.writelines(",".join(row) + "\n" for row in zip(*texts, strict=True))


class ParquetSink:
    """Apache Parquet, a row group a piece. Needs pyarrow."""

    def __init__(self, path: Path) -> None:
        """
        Raises:
            MissingExtra: no pyarrow.
        """
        require_pyarrow()
        self._path = path
        self._stream = path.open("xb")
        self._writer: Any = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._writer is not None:
            self._writer.close()
        self._stream.close()

    def write(self, rows: Columns) -> None:
        """Adds rows."""
        import pyarrow
        from pyarrow import parquet

        table = pyarrow.table(rows)
        if self._writer is None:
            self._writer = parquet.ParquetWriter(self._stream, table.schema, compression="zstd")
        self._writer.write_table(table)


def require_pyarrow() -> None:
    """
    Raises:
        MissingExtra: it is not installed.
    """
    if find_spec("pyarrow") is None:
        raise MissingExtra("Parquet", "pyarrow")
