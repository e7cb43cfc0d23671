"""Ctrl-C while something moves: stop it, see it stand, leave. A second one leaves at once."""

import os
import signal
import time
from types import FrameType

from axisync_cli import sentences
from axisync_cli.entry import EXIT_INTERRUPTED
from axisync_cli.terminal import Terminal
from axisync_client import AxisyncError, Client, GroupState

STAND_TIMEOUT_S = 30.0
POLL_S = 0.05
ON_THE_WAY = frozenset(
    state.label for state in (GroupState.MOVING, GroupState.STOPPING, GroupState.HOMING, GroupState.JOGGING)
)


def stop_and_wait(terminal: Terminal, client: Client, group: str) -> int:
    """Stops the group, waits until it stands, and returns the exit code. Call it while the lease is still held."""
    signal.signal(signal.SIGINT, _leave_at_once)
    try:
        stopped = client.stop(group).groups
        terminal.say(f"interrupted: stopping {', '.join(stopped)} (Ctrl-C again leaves at once)")
        terminal.say(sentences.of_states(stand(client, list(stopped), STAND_TIMEOUT_S)))
    except AxisyncError as error:
        terminal.say(f"the stop is not confirmed: {sentences.of_error(error, group)}")
    return EXIT_INTERRUPTED


def stand(client: Client, names: list[str], timeout_s: float) -> dict[str, str]:
    """States of the groups once none is on its way, or after the time-out."""
    end = time.monotonic() + timeout_s
    while True:
        groups = client.state().groups
        states = {name: groups[name].state for name in names if name in groups}
        if not ON_THE_WAY.intersection(states.values()) or time.monotonic() > end:
            return states
        time.sleep(POLL_S)


def _leave_at_once(signal_number: int, frame: FrameType | None) -> None:
    """The stop has been sent or cannot be; without renewals the lease lapses, which holds what still moves."""
    os._exit(EXIT_INTERRUPTED)
