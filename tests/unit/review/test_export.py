"""Exported tables hold what the log holds, to the bit, under names with units."""

import csv
from pathlib import Path

import numpy as np
import pytest

from axisync_review import export
from support.command_line import Run
from support.logread import Log, read_log


def expected(log: Log) -> dict[str, np.ndarray]:  # type: ignore[type-arg]
    ticks = log.ticks
    return {
        "kingkong.1.position_rad": ticks["position"][:, 0],
        "wukong.6.jerk_rad_s3": ticks["jerk"][:, 11],
        "kingkong.3.target_counts": ticks["target_counts"][:, 2],
        "wukong.path_rate": ticks["path_rate"][:, 1],
        "lateness_ns": ticks["lateness_ns"],
        "tick": ticks["tick"],
        "wall_time_ns": log.log_times_ns,
        "time_s": (log.log_times_ns - log.log_times_ns[0]) / 1e9,
    }


def test_parquet(run: Run, stopped_log: Path, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    out = tmp_path / "log.parquet"
    shown = run("export", stopped_log, "--parquet", "-o", out)
    log = read_log(stopped_log)
    assert (shown.code, shown.out, shown.err) == (0, f"{len(log.ticks):,} ticks in {out}\n", "")
    table = parquet.read_table(out)
    assert table.num_columns == 6 + 12 * 7 + 2 * 4
    for name, values in expected(log).items():
        assert (table[name].to_numpy() == values).all(), name


def test_csv(run: Run, stopped_log: Path, tmp_path: Path) -> None:
    out = tmp_path / "log.csv"
    assert run("export", stopped_log, "--csv", "-o", out, "--json").json["rows"] == len(read_log(stopped_log).ticks)
    with out.open(newline="") as stream:
        head, *rows = csv.reader(stream)
    log = read_log(stopped_log)
    assert len(head) == 6 + 12 * 7 + 2 * 4
    for name, values in expected(log).items():
        column = head.index(name)
        number = float if values.dtype == np.float64 else int
        assert [number(row[column]) for row in rows] == values.tolist(), name


def test_every_field_of_a_tick_has_a_column(stopped_log: Path) -> None:
    fields = {"tick", "cycle_start_ns", "lateness_ns", "skipped", *export.PER_AXIS, *export.PER_GROUP}
    assert fields == set(read_log(stopped_log).layout.fields)


def test_without_pyarrow(run: Run, good_log: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = export.find_spec
    monkeypatch.setattr(export, "find_spec", lambda name: None if name == "pyarrow" else found(name))
    shown = run("export", good_log, "--parquet", "-o", tmp_path / "a.parquet")
    assert shown.code == 1
    assert shown.err.startswith("Parquet needs pyarrow, which is not installed: run `")
    assert not list(tmp_path.iterdir())
