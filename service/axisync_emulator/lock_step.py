"""The loop in lock-step: time moves when everyone waits, as far as someone waits for."""

import select
from collections.abc import Sequence

from axisync_emulator.faults.control import Control
from axisync_emulator.linux import StopRequest
from axisync_emulator.simcan.hub import Hub
from axisync_emulator.simcan.time_server import TimeServer


def run_lock_step(hubs: Sequence[Hub], times: TimeServer, stop: StopRequest, control: Control | None = None) -> None:
    """Serves until a stop is requested."""
    while not stop.requested:
        _listen(hubs, times, stop, control)
        if times.all_wait:
            for hub in hubs:
                hub.drain()
            _advance(hubs, times)


def _listen(hubs: Sequence[Hub], times: TimeServer, stop: StopRequest, control: Control | None) -> None:
    """Waits for someone to say something; takes frames in at once, so that no socket fills."""
    descriptors = [stop.fileno(), times.listener.fileno(), *(p.fileno() for p in times.participants)]
    for hub in hubs:
        descriptors += hub.descriptors
    if control is not None:
        descriptors += control.descriptors
    readable = set(select.select(descriptors, [], [])[0])
    if control is not None:
        control.catch_up(readable)
    for hub in hubs:
        if hub.listener.fileno() in readable:
            hub.accept()
        hub.drain()
    if times.listener.fileno() in readable:
        times.accept()
    for participant in tuple(times.participants):
        if participant.fileno() in readable:
            times.read(participant)


def _advance(hubs: Sequence[Hub], times: TimeServer) -> None:
    target, wakeable = times.earliest, times.wakeable
    woken: frozenset[int] = frozenset()
    if wakeable:
        target, woken = _advance_until_frame(hubs, target, wakeable)
    else:
        for hub in hubs:
            hub.advance(target)
    for hub in hubs:
        hub.flush()
    times.grant(target, woken)


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
