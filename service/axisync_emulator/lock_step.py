"""The loop in lock-step: time moves when everyone waits, as far as someone waits for. A run is a function of its inputs."""

import select
from collections.abc import Callable, Sequence

from axisync_emulator.simcan.hub import Hub
from axisync_emulator.simcan.time_server import TimeServer

_POLL_S = 0.5
"""How soon a request to stop is seen by a loop that nothing else wakes."""


def run_lock_step(hubs: Sequence[Hub], times: TimeServer, stopping: Callable[[], bool]) -> None:
    """Serves until `stopping()`."""
    while not stopping():
        _listen(hubs, times)
        if times.all_wait:
            for hub in hubs:
                hub.drain()
            _advance(hubs, times)


def _listen(hubs: Sequence[Hub], times: TimeServer) -> None:
    """Waits for someone to say something; frames of others are taken in on the way, so that their sockets never fill."""
    clients = [(hub, client) for hub in hubs for client in hub.clients]
    sources = [times.listener, *times.participants, *(hub.listener for hub in hubs), *(client for _, client in clients)]
    readable = set(select.select(sources, [], [], _POLL_S)[0])
    for hub in hubs:
        if hub.listener in readable:
            hub.accept()
    if times.listener in readable:
        times.accept()
    for participant in tuple(times.participants):
        if participant in readable:
            times.read(participant)
    for hub, client in clients:
        if client in readable:
            hub.read(client)


def _advance(hubs: Sequence[Hub], times: TimeServer) -> None:
    target, wakeable = times.earliest, times.wakeable
    woken: frozenset[int] = frozenset()
    if wakeable:
        now, woken = _advance_until_frame(hubs, target, wakeable)
    else:
        now = target
        for hub in hubs:
            hub.advance(target)
    for hub in hubs:
        hub.flush()
    times.grant(now, woken)


def _advance_until_frame(hubs: Sequence[Hub], target: int, wakeable: frozenset[int]) -> tuple[int, frozenset[int]]:
    """Event by event over all buses; returns where it ended, and the processes whose frame ended it."""
    while True:
        # One ns past an event, so that a frame which starts there has started.
        now = min(target, 1 + min(hub.next_event for hub in hubs))
        for hub in hubs:
            hub.advance(now)
        woken = frozenset(c.pid for hub in hubs for c in hub.clients if c.outgoing and c.pid in wakeable)
        if woken or now >= target:
            return now, woken
