"""Draws a move from its live setpoint stream: position, velocity, acceleration and jerk of each axis.

Start `axisyncd demo` in another terminal, then: python clients/examples/streaming_plot.py move.svg
Without matplotlib, or without a file, it prints a table.
"""

import asyncio
import sys

import numpy as np

from axisync_client import AsyncClient, AsyncMove, AsyncStream, AxisyncError, Setpoints, deg, to_deg

QUANTITIES = ("position", "velocity", "acceleration", "jerk")
GROUP = "kingkong"


async def recorded(move: AsyncMove, stream: AsyncStream[Setpoints]) -> list[Setpoints]:
    """Batches from now until the move has ended, and the one that shows its last setpoint."""
    ended = asyncio.create_task(move.result())
    batches = []
    while not ended.done():
        batches.append(await anext(stream))
    report = ended.result()
    while batches[-1].time_s[-1] < report.now_s:
        batches.append(await anext(stream))
    return batches


async def watch_a_move() -> tuple[np.ndarray, dict[str, np.ndarray], list[str]]:
    """Times [m] in s; quantities [m, n] in degrees; names of the axes [n]."""
    async with AsyncClient() as client, client.lease(GROUP) as arm, client.setpoints() as stream:
        await arm.enable()
        columns = (await anext(stream)).columns(GROUP, await client.config())
        for step in (12, -12):
            move = await arm.move_joint(deg(step, step / 2, -step / 3, 0, 0, step), relative=True)
            batches = await recorded(move, stream)
        print(f"{sum(map(len, batches))} ticks received, {stream.missed} batches missed")
    times = np.concatenate([batch.time_s for batch in batches])
    values = {name: to_deg(np.concatenate([getattr(b, name) for b in batches])[:, columns]) for name in QUANTITIES}
    return times - times[0], values, [batches[0].axes[column] for column in columns]


def draw(path: str, times: np.ndarray, values: dict[str, np.ndarray], axes: list[str]) -> None:
    """A picture of four panels."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 9), layout="constrained")
    for panel, (name, curves) in zip(figure.subplots(4, sharex=True), values.items(), strict=True):
        panel.plot(times, curves, label=axes)
        panel.set_ylabel(name)
    panel.set_xlabel("s; degrees throughout")
    panel.legend(ncols=len(axes), fontsize="x-small")
    figure.savefig(path)
    print(f"drawn in {path}")


def table(times: np.ndarray, values: dict[str, np.ndarray], axes: list[str]) -> None:
    """The largest magnitudes, a line for each axis."""
    print(f"{times[-1]:.2f} s; largest velocity, acceleration, jerk in degrees:")
    for column, axis in enumerate(axes):
        peaks = (f"{np.abs(values[name][:, column]).max():9.3f}" for name in QUANTITIES[1:])
        print(f"{axis:12}", *peaks)


def main() -> int:
    try:
        recording = asyncio.run(watch_a_move())
    except AxisyncError as error:
        print(error)
        return 1
    try:
        if len(sys.argv) > 1:
            draw(sys.argv[1], *recording)
            return 0
    except ImportError:
        print("no picture without matplotlib")
    table(*recording)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
