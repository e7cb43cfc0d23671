"""`axisync-emulator CELL.toml`: the drives of a cell, on its own buses or on simcan."""

import gc
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from axisync_emulator.faults.command import app as injection
from axisync_emulator.faults.model import FaultError, Script, read_script
from axisync_emulator.linux import StopRequest, die_with_parent, precise_timers, real_time_priority
from axisync_emulator.world import World, WorldError, build
from axisync_schemas.cell import Cell, CellError, read_cell

USAGE, FAILURE = 2, 1

app = typer.Typer(add_completion=False)


@app.command()
def emulate(
    cell: Annotated[Path, typer.Argument(help="The cell file.")],
    bus: Annotated[list[str] | None, typer.Option(help="Only the drives of this bus; may be repeated.")] = None,
    simcan: Annotated[Path | None, typer.Option(help="Serve simcan sockets in this directory instead.")] = None,
    lock_step: Annotated[bool, typer.Option("--lock-step", help="Own the time: run only while all wait.")] = False,
    participants: Annotated[int, typer.Option(min=1, help="Lock-step starts when so many take part.")] = 1,
    candump: Annotated[Path | None, typer.Option(help="Log every frame to this file, as candump -L does.")] = None,
    faults: Annotated[Path | None, typer.Option(help="Make these faults: a script in TOML or JSON.")] = None,
    control: Annotated[Path | None, typer.Option(help="Take faults at run time on this socket, see `inject`.")] = None,
    statistics: Annotated[bool, typer.Option("--statistics", help="Print frames and bits of each bus at end.")] = False,
    priority: Annotated[
        int, typer.Option(min=0, max=99, help="Run under SCHED_FIFO at this priority, where permitted; 0: do not.")
    ] = 0,
    with_parent: Annotated[bool, typer.Option("--die-with-parent", help="End when the parent process ends.")] = False,
) -> None:
    """Emulates the drives of a cell. Prints `ready` once they are on the bus; ends on SIGTERM and SIGINT."""
    stop = StopRequest()
    stop.install()
    if with_parent and not die_with_parent():
        raise typer.Exit(FAILURE)
    world = _open(cell, simcan, faults, lambda parsed, script: build(
        parsed, bus or [], lock_step=lock_step, participants=participants, candump=candump, faults=script,
        control=control,
    ))  # fmt: skip
    if priority and not real_time_priority(priority):
        print(f"axisync-emulator: no permission for SCHED_FIFO priority {priority}: answers may come late",
              file=sys.stderr)  # fmt: skip
    try:
        _run(world, stop)
    except OSError as error:
        _fail(str(error), FAILURE)
    if statistics:
        print(*world.statistics(), sep="\n", file=sys.stderr)


def _run(world: World, stop: StopRequest) -> None:
    precise_timers()
    # Everything that lives long exists by now; a collection in mid-cycle would only walk it again.
    gc.collect()
    gc.freeze()
    try:
        print("ready", flush=True)
        world.run(stop)
    finally:
        world.close()
        stop.close()


def _open(path: Path, simcan: Path | None, faults: Path | None, make: Callable[[Cell, Script | None], World]) -> World:
    try:
        cell, _ = read_cell(path)
        if simcan is not None:
            simcan.mkdir(parents=True, exist_ok=True)
            cell = cell.on_simcan(str(simcan))
        return make(cell, read_script(faults) if faults else None)
    except (WorldError, FaultError) as error:
        _fail(str(error), USAGE)
    except (CellError, OSError) as error:
        _fail(str(error), FAILURE)


def _fail(message: str, status: int) -> NoReturn:
    print(f"axisync-emulator: {message}", file=sys.stderr)
    raise typer.Exit(status)


def main() -> None:
    """Entry point: the emulator, or `axisync-emulator inject ...` for one that runs."""
    if sys.argv[1:2] == ["inject"]:
        injection(sys.argv[2:], prog_name="axisync-emulator inject")
    app()


if __name__ == "__main__":
    main()
