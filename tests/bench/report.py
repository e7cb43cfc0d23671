"""Prints the results: a table for each question."""

from collections.abc import Iterable, Mapping, Sequence

from percentiles import Distribution
from processes import Usage
from rich.console import Console
from rich.table import Table

WIDTH = 110


class Report:
    """Tables on the terminal, and the same numbers as JSON."""

    def __init__(self, console: Console | None = None) -> None:
        self._console = console or Console()
        if not self._console.is_terminal:
            self._console.width = WIDTH
        self.data: dict[str, object] = {}

    def say(self, sentence: str) -> None:
        """A line of progress or explanation."""
        self._console.print(sentence, highlight=False, markup=False, soft_wrap=True)

    def distributions(
        self,
        name: str,
        title: str,
        unit: str,
        rows: Mapping[str, Distribution],
        percents: Sequence[float],
        extra: Mapping[str, Mapping[str, object]] | None = None,
    ) -> None:
        """One row a distribution. `extra`: more columns, by column and row."""
        extra = extra or {}
        headings = [unit, *(f"p{percent:g}" for percent in percents), "max", "samples", *extra]
        lines = [
            [
                row,
                *(_number(distribution.percentile(percent)) for percent in percents),
                _number(distribution.maximum),
                f"{distribution.total:,}",
                *(str(column.get(row, "")) for column in extra.values()),
            ]
            for row, distribution in rows.items()
        ]
        self._table(title, headings, lines)
        self.data[name] = {
            row: {**distribution.summary(*percents), **{key: col[row] for key, col in extra.items() if row in col}}
            for row, distribution in rows.items()
        } | {"unit": unit}

    def processes(self, title: str, usages: Sequence[Usage]) -> None:
        """CPU and memory of each process."""
        lines = [
            [usage.name, f"{100 * usage.cpu:.1f} %", f"{usage.memory_mib:.1f} MiB", str(usage.threads)]
            for usage in usages
        ]
        cpu, memory = sum(usage.cpu for usage in usages), sum(usage.memory_mib for usage in usages)
        lines.append(["all", f"{100 * cpu:.1f} %", f"{memory:.1f} MiB", str(sum(usage.threads for usage in usages))])
        self._table(title, ["process", "of one core", "memory", "threads"], lines)
        self.data["processes"] = [
            {"process": u.name, "cpu": u.cpu, "memory_mib": u.memory_mib, "threads": u.threads} for u in usages
        ]

    def table(self, name: str, title: str, headings: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
        """Words and numbers as they are."""
        self._table(title, headings, lines)
        self.data[name] = [dict(zip(headings, line, strict=True)) for line in lines]

    def _table(self, title: str, headings: Sequence[str], lines: Iterable[Sequence[str]]) -> None:
        table = Table(title=title, title_justify="left", title_style="bold")
        for i, heading in enumerate(headings):
            table.add_column(heading, justify="left" if i == 0 else "right", no_wrap=True)
        for line in lines:
            table.add_row(*line)
        self._console.print(table)


def _number(value: float) -> str:
    """Three significant digits at least, no exponent."""
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
