"""How long a client waits for its answers, beside the network alone: `--only clients`."""

import asyncio
import json
import time
from collections.abc import Callable

import zenoh
from percentiles import Distribution
from phases import Arms
from report import Report

from axisync_client import AsyncClient, Client
from axisync_schemas import keys

QUERIES = 200
COMMAND_GROUP = "kingkong"


def measure(report: Report, client: Client, arms: Arms, moves: int) -> None:
    """Moves as a caller sees them: from the call to the accepted move, beside plain queries.

    The static `config` is answered by a callback of the daemon's and tells what network and Zenoh take; `state` goes
    through the daemon's queue.
    """
    config = keys.topic(client.cell, "config")
    rows = {
        "bare Zenoh query": _bare(client.endpoint, config),
        "Client.config": _calls(client.config),
        "Client.state": _calls(client.state),
        "AsyncClient.state": asyncio.run(_awaited(client.endpoint)),
        "Client.stop": _calls(lambda: client.stop(COMMAND_GROUP)),
    }
    for what, moved in (("one arm", arms.of(COMMAND_GROUP)), ("both arms", arms)):
        times = [call.answered_ns - call.called_ns for call in moved.requests(moves)]
        rows[f"Lease.move_joint, {what}"] = _milliseconds(times)
    report.distributions("clients", "Calls of a client, to their answer", "ms", rows, (50, 99))


def _calls(ask: Callable[[], object]) -> Distribution:
    times = []
    for _ in range(QUERIES):
        begin = time.monotonic_ns()
        ask()
        times.append(time.monotonic_ns() - begin)
    return _milliseconds(times)


async def _awaited(endpoint: str) -> Distribution:
    times = []
    async with AsyncClient(endpoint) as client:
        for _ in range(QUERIES):
            begin = time.monotonic_ns()
            await client.state()
            times.append(time.monotonic_ns() - begin)
    return _milliseconds(times)


def _bare(endpoint: str, key: str) -> Distribution:
    """Zenoh by itself: no model, no retry, the default options."""
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps("client"))
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:

        def ask() -> None:
            replies = [reply for reply in session.get(key) if reply.ok is not None]
            if len(replies) != 1:
                raise RuntimeError(f"{key} had {len(replies)} answers")

        return _calls(ask)


def _milliseconds(times_ns: list[int]) -> Distribution:
    return Distribution.of([time_ns / 1e6 for time_ns in times_ns])
