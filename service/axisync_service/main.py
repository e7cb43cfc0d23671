"""`axisyncd`: the daemon's command line. Exit: 0 done, 1 refused or failed, 2 usage."""

import math
import os
import tempfile
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from axisync_schemas.cell import Cell, CellError, read_cell
from axisync_schemas.cell_remarks import remarks
from axisync_schemas.eds import EdsError
from axisync_service.bus_table import print_buses
from axisync_service.canopen.budget import LOAD_MAX, budget
from axisync_service.daemon.locks import CannotRun, runtime_directory
from axisync_service.demo import (
    EmulatorFailed,
    Emulators,
    Extras,
    Program,
    ReviewOfRun,
    kernel_has,
    next_steps,
    patient,
    program_for,
)
from axisync_service.demo_page import Page
from axisync_service.doctor import report as doctor_report
from axisync_service.doctor.facts import gather
from axisync_service.doctor.findings import dangerous, findings
from axisync_service.doctor.latency import Latency, LatencyError, measure
from axisync_service.eds_import import import_section
from axisync_service.motion_controller import realtime
from axisync_service.process import LOG_LEVEL_VARIABLE
from axisync_service.supervisor import Supervisor

DEFAULT_LISTEN = "tcp/127.0.0.1:7447"
CELLS = Path(__file__).parent / "cells"

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False, help=__doc__)

CellFile = Annotated[Path, typer.Argument(help="The cell file.", show_default=False)]
LogDir = Annotated[Path, typer.Option(help="Where logs are written.")]
Listen = Annotated[str, typer.Option(help="Zenoh endpoint; loopback only, as long as nobody must log in.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Log what each process does.")]


@app.command()
def run(
    cell_file: CellFile,
    log_dir: LogDir = Path("logs"),
    listen: Listen = DEFAULT_LISTEN,
    simcan: Annotated[str, typer.Option(help="Use simulated buses with sockets in this directory.")] = "",
    verbose: Verbose = False,
) -> None:
    """Serve a cell on its buses, in the foreground, until SIGINT or SIGTERM."""
    cell, text = _load(cell_file)
    _set_verbosity(verbose)
    supervisor = _supervisor(cell.on_simcan(simcan) if simcan else cell, text, log_dir, listen, simcan)
    supervisor.on_ready = _say_ready
    raise typer.Exit(supervisor.run())


@app.command()
def demo(
    log_dir: LogDir = Path("logs"),
    listen: Listen = DEFAULT_LISTEN,
    dashboard: Annotated[bool, typer.Option(help="Also serve the web page, where it is installed.")] = True,
    dashboard_port: Annotated[int, typer.Option(min=1, max=65535, help="Where, on this machine only.")] = 7448,
    program: Annotated[bool, typer.Option(help="Play the program.")] = True,
    cell_file: Annotated[Path, typer.Option("--cell", help="Another cell file.")] = CELLS / "eod.toml",
    candump: Annotated[Path | None, typer.Option(help="Write each bus's frames to BUS.log in this directory.")] = None,
    control: Annotated[
        Path | None, typer.Option(help="Take faults on BUS.sock in this directory, see `axisync-emulator inject`.")
    ] = None,
    verbose: Verbose = False,
) -> None:
    """Both arms of the paper on emulated drives: plays the tool change and WuKong's points, then waits for you."""
    _set_verbosity(verbose)
    with _scratch_directory() as scratch:
        used = _demo_cell_file(cell_file, Path(scratch))
        cell, text = _load(used)
        simcan = "" if kernel_has(cell) else scratch
        channels = ", ".join(bus.channel for bus in cell.buses)
        print(
            f"Buses: simulated (simcan), since this kernel has no {channels} (deploy/vcan.sh)."
            if simcan
            else f"Buses: {channels} of this kernel.",
            flush=True,
        )
        cell = cell.on_simcan(simcan) if simcan else cell
        page = Page(listen, dashboard_port) if dashboard else None
        raise typer.Exit(_demo(cell, text, used, log_dir, listen, simcan, program, Extras(candump, control), page))


def _scratch_directory() -> tempfile.TemporaryDirectory[str]:
    try:
        return tempfile.TemporaryDirectory(prefix="demo-", dir=runtime_directory())
    except CannotRun as error:
        _refuse(error)


def _demo_cell_file(cell_file: Path, scratch: Path) -> Path:
    """A copy of the cell file that waits longer for emulated drives, and without real-time priority for everything."""
    _, text = _load(cell_file)
    if not realtime.permitted():
        print("No real-time priority here: this demo tolerates late ticks (see deploy/realtime.md).", flush=True)
    used = scratch / "cell.toml"
    used.write_text(patient(text, realtime.permitted()), encoding="utf-8")
    return used


def _demo(
    cell: Cell,
    text: str,
    cell_file: Path,
    log_dir: Path,
    listen: str,
    simcan: str,
    play: bool,
    extras: Extras,
    page: Page | None,
) -> int:
    supervisor = _supervisor(cell, text, log_dir, listen, simcan)
    emulators, program = Emulators(), Program(listen, program_for(cell), ReviewOfRun(supervisor.control, log_dir, cell))

    def on_ready(missing: list[str]) -> None:
        _say_ready(missing)
        if page is not None:
            page.start()
        if play:
            program.begin()

    def each_poll() -> None:
        if program.poll():
            print(program.failed or next_steps(cell, listen, log_dir), flush=True)

    supervisor.on_ready, supervisor.each_poll = on_ready, each_poll
    try:
        emulators.start(cell_file, cell, simcan, extras)
        return supervisor.run()
    except EmulatorFailed as error:
        typer.echo(f"axisyncd: {error}", err=True)
        return 1
    finally:
        program.stop()
        if page is not None:
            page.stop()
        emulators.stop()


@app.command()
def check(cell_file: CellFile) -> None:
    """Check a cell file; print its axes, limits and the load of each bus."""
    cell, _ = _load(cell_file, refuse_overload=False)
    print(f"{cell.name}: axes {len(cell.axes)}, buses {len(cell.buses)}, period {cell.period * 1e3:g} ms")
    print(f"\n{'axis':<14}{'group':<12}{'bus:node':<16}{'soft limits':>18}{'hard limits':>18}{'V':>8}{'A':>8}{'J':>8}")
    for group in cell.groups:
        for axis in group.axes:
            low, high = (math.degrees(limit) for limit in axis.soft_limits)
            hard_low, hard_high = (math.degrees(limit) for limit in axis.hard_limits)
            limits = [math.degrees(x) for x in (axis.limits.velocity, axis.limits.acceleration, axis.limits.jerk)]
            print(
                f"{axis.name:<14}{group.name:<12}{axis.drive.bus + ':' + str(axis.drive.node_id):<16}"
                f"{f'{low:g} .. {high:g}':>18}{f'{hard_low:g} .. {hard_high:g}':>18}"
                + "".join(f"{value:>8g}" for value in limits)
            )
    print("\nlimits in deg, deg/s, deg/s^2, deg/s^3")
    for remark in remarks(cell):
        print(f"note: {remark}")
    raise typer.Exit(0 if print_buses(cell) else 1)


@app.command()
def doctor(
    cell_file: Annotated[
        Path | None, typer.Option("--cell", help="Also look at the CAN interfaces of this cell.")
    ] = None,
    seconds: Annotated[float, typer.Option(min=0.0, max=3600.0, help="Of the latency test; 0: none.")] = 10.0,
    as_json: Annotated[bool, typer.Option("--json", help="For programs.")] = False,
) -> None:
    """Is this machine fit for the cycle? Says what to change; exit 1 if the cycle would be in danger."""
    cell = _load(cell_file)[0] if cell_file is not None else None
    facts = gather([bus.channel for bus in cell.buses if bus.interface == "socketcan"] if cell else ())
    try:
        latency = _latency(cell, seconds) if seconds else None
    except LatencyError as error:
        _refuse(error)
    found = findings(facts, latency)
    print(doctor_report.as_json(facts, latency, found) if as_json else doctor_report.as_text(found))
    raise typer.Exit(1 if dangerous(found) else 0)


def _latency(cell: Cell | None, seconds: float) -> Latency:
    if cell is None:
        return measure(seconds)
    worst_wire_s = max(budget(cell, bus).cyclic_s for bus in cell.buses)
    return measure(seconds, cell.period_ns, round(worst_wire_s * 1e9), cell.missed_ticks_max)


@app.command("import-eds")
def import_eds(
    eds_file: Annotated[Path, typer.Argument(help="The drive's electronic data sheet.", show_default=False)],
    bus: Annotated[str, typer.Option(help="Bus of the drive.")] = "can0",
    node: Annotated[int, typer.Option(min=1, max=126, help="Its node id.")] = 1,
) -> None:
    """Print the cell file's drive section for a drive's EDS; say what it lacks."""
    try:
        imported = import_section(eds_file, bus, node)
    except EdsError as error:
        typer.echo(f"axisyncd: {eds_file}: {error}", err=True)
        raise typer.Exit(1) from None
    print(imported.section)
    for warning in imported.warnings:
        typer.echo(f"warning: {warning}", err=True)
    raise typer.Exit(1 if imported.unusable else 0)


def _load(path: Path, refuse_overload: bool = True) -> tuple[Cell, str]:
    try:
        cell, text = read_cell(path)
    except CellError as error:
        _refuse(error)
    for bus in cell.buses:
        load = budget(cell, bus)
        if refuse_overload and not load.fits:
            typer.echo(
                f"axisyncd: {path}: bus {bus.name} would be {load.load:.1%} full, {LOAD_MAX:.0%} is the most: "
                f"see `axisyncd check {path}`",
                err=True,
            )
            raise typer.Exit(1)
    return cell, text


def _supervisor(cell: Cell, text: str, log_dir: Path, listen: str, simcan: str) -> Supervisor:
    try:
        return Supervisor(cell, text, log_dir.resolve(), listen, simcan)
    except CannotRun as error:
        _refuse(error)


def _refuse(error: Exception) -> NoReturn:
    typer.echo(f"axisyncd: {error}", err=True)
    raise typer.Exit(1) from None


def _set_verbosity(verbose: bool) -> None:
    os.environ.setdefault(LOG_LEVEL_VARIABLE, "INFO" if verbose else "ERROR")


def _say_ready(missing: list[str]) -> None:
    for what in missing:
        typer.echo(f"axisyncd: not there yet: {what}", err=True)
    print("ready", flush=True)


def main() -> None:
    """Entry point."""
    app()


if __name__ == "__main__":
    main()
