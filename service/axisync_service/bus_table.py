"""`axisyncd check`: how full each bus is, and what would fit."""

import typer

from axisync_schemas.cell import Cell
from axisync_service.canopen.budget import LOAD_MAX, BusBudget, budget


def print_buses(cell: Cell) -> bool:
    """Prints the table; whether every bus keeps the bound."""
    budgets = [budget(cell, bus) for bus in cell.buses]
    typer.echo(f"\n{'bus':<14}{'drives':>7}{'cyclic':>12}{'TPDO2':>12}{'worst':>8}{'typical':>9}{'worst cycle':>16}")
    for b in budgets:
        every = f"1 in {b.tpdo2_interval}" if b.tpdo2_interval else "off"
        worst = f"{b.worst_cycle_s * 1e6:.0f} us ({b.worst_cycle_s / b.period_s:.0%})"
        typer.echo(
            f"{b.bus:<14}{b.drives:>7}{f'{b.cyclic_s * 1e6:.0f} us':>12}{every:>12}{f'{b.load:.1%}':>8}"
            f"{f'{b.typical:.1%}':>9}{worst:>16}"
        )
        for line in _remarks(b):
            typer.echo(f"  {line}")
    typer.echo(
        f"\nworst: every bit that can be stuffed is, heartbeats, one SDO frame a cycle; {LOAD_MAX:.0%} is the most."
        "\ntypical: frames as they usually are, no SDO. worst cycle: everything that can fall due at once does."
    )
    return all(b.fits for b in budgets)


def _remarks(b: BusBudget) -> list[str]:
    shortest = f"{b.period_min_s * 1e3:g} ms" if b.period_min_s else "more than 1 s"
    remarks = []
    if not b.fits:
        remarks.append(f"refused: over {LOAD_MAX:.0%}; use a longer period_ms, a faster bus, or another bus")
    elif b.worst_cycle_s > b.period_s:
        remarks.append("warning: a cycle in which everything falls due does not fit; frames will be late in it")
    if b.fits and b.drives and b.tpdo2_interval is None:
        remarks.append("no room for TPDO2: drives report neither velocity nor torque")
    most = f"{b.drives_max} drives at {b.period_s * 1e3:g} ms"
    remarks.append(f"would fit, without TPDO2: {b.drives} drives at {shortest}, or {most}")
    return remarks
