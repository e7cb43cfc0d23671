"""The recorder's process: `python -m axisync_service.recorder_process`, started by the supervisor."""

import logging
import os
import socket
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack

from axisync_schemas.enumerations import Phase, RecorderState
from axisync_schemas.memory import Mailbox, Word
from axisync_schemas.tick_ring import TickRing, slots_for
from axisync_schemas.ticks import TickLayout
from axisync_service.log_lines import LineHandler
from axisync_service.process import ProcessContext, start
from axisync_service.recorder.recorder import Recorder, SharedMemory

STEP_S = 0.02
PATIENCE_S = 5.0
"""How long a lone SIGTERM waits for the controller to be done."""

log = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Records until the service closes; 0 when the log is whole, 1 where it could not be begun or ended."""
    context = start("recorder", arguments)
    with ExitStack() as stack:
        sockets = [stack.enter_context(one) for one in log_sockets(context)]
        recorder = make_recorder(context, sockets)
        logging.getLogger().addHandler(LineHandler("recorder", recorder.add_line))
        if not begin(context, recorder):
            return 1
        ending = Ending(context)
        while not ending.come():
            if not recorder.step():
                time.sleep(STEP_S)
        return 0 if recorder.close() else 1


def log_sockets(context: ProcessContext) -> list[socket.socket]:
    """The ends from which this process reads: `log_front`, `log_planner`..."""
    return [socket.socket(fileno=fd) for name, fd in sorted(context.sockets.items()) if name.startswith("log_")]


def make_recorder(context: ProcessContext, sockets: Sequence[socket.socket]) -> Recorder:
    """The recorder on what the supervisor passed."""
    cell = context.cell
    layout = TickLayout(len(cell.axes), len(cell.groups))
    ring = TickRing(context.regions["ticks"].map(writable=False), layout, slots_for(cell.period))
    plans = context.regions["plans"].map(writable=False)
    memory = SharedMemory(context.control, ring, plans, Mailbox(context.regions["recorder"].map()))
    return Recorder(cell, context.cell_text, context.log_dir, memory, sockets)


def begin(context: ProcessContext, recorder: Recorder) -> bool:
    """Opens the first file. False: the service cannot start so; once it has run, an error only means trying again."""
    started = context.control[Word.RECORDER_STATE] != RecorderState.NOT_STARTED
    try:
        recorder.open()
    except OSError as error:
        if not started:
            print(f"axisyncd: cannot write a log into {context.log_dir}: {error.strerror}", file=sys.stderr)
            return False
        log.warning("kind=log_failed directory=%s error=%r", context.log_dir, error.strerror)
        recorder.failing(error)
    return True


class Ending:
    """When the recorder is to close: the phase CLOSING, or a SIGTERM of its own and nothing more to come."""

    def __init__(self, context: ProcessContext) -> None:
        self._context = context
        self._since: float | None = None

    def come(self) -> bool:
        """True from then on."""
        phase = self._context.phase()
        if phase is Phase.RUNNING:
            return False
        if phase is Phase.CLOSING:
            return True
        supervised = self._context.control[Word.PHASE] == Phase.STOPPING and os.getppid() == self._context.parent
        if supervised:  # It says CLOSING when the drives are disabled.
            return False
        self._since = time.monotonic() if self._since is None else self._since
        done = bool(self._context.control[Word.CONTROLLER_DONE])
        return done or time.monotonic() - self._since > PATIENCE_S


if __name__ == "__main__":
    sys.exit(main())
