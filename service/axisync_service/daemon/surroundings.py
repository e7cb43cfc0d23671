"""What a run needs before its first process: a private directory, shared memory, listening sockets, log sockets."""

import shutil
import socket
import tempfile
from dataclasses import dataclass
from pathlib import Path

from axisync_schemas.cell import Cell
from axisync_schemas.memory import Control, Region, create, region_sizes
from axisync_service.daemon.locks import CannotRun, runtime_directory

LOG_SENDERS = ("front", "planner", "controller", "supervisor")
LOG_BUFFER_BYTES = 4 * 1024 * 1024
NAME_MAX = 16
"""Of the cell's name in the run's directory: a socket's path has at most 107 bytes (unix(7))."""
_SO_SNDBUFFORCE = 32


@dataclass(frozen=True, slots=True)
class Surroundings:
    """Of one run.

    Attributes:
        listening: sockets that front connects to, by owner; they outlive their owner, so that a restarted one goes on.
        log: for each sender its end and the recorder's. Both stay open here, so that entries survive a restart.
    """

    run_dir: Path
    regions: dict[str, Region]
    control: Control
    listening: dict[str, socket.socket]
    log: dict[str, tuple[socket.socket, socket.socket]]

    def descriptors(self, process: str) -> dict[str, int]:
        """What a child inherits, by name."""
        given = {name: region.descriptor for name, region in self.regions.items()}
        if process in self.listening:
            given[f"{process}_listen"] = self.listening[process].fileno()
        if process == "recorder":
            given |= {f"log_{sender}": ends[1].fileno() for sender, ends in self.log.items()}
        else:
            given["log"] = self.log[process][0].fileno()
        return given

    def close(self) -> None:
        """Closes sockets and removes the directory."""
        for listening in self.listening.values():
            listening.close()
        for ends in self.log.values():
            for end in ends:
                end.close()
        shutil.rmtree(self.run_dir, ignore_errors=True)


def make_surroundings(cell: Cell, cell_text: str) -> Surroundings:
    """Prepares a run; the cell file is copied, so that a restarted process sees what the first one saw.

    Raises:
        CannotRun: the runtime directory does not serve; nothing is left in it.
    """
    run_dir = Path(tempfile.mkdtemp(prefix=f"{cell.name[:NAME_MAX]}-", dir=runtime_directory()))
    try:
        listening = {owner: _listen(run_dir / f"{owner}.sock") for owner in ("controller", "planner")}
    except OSError as error:
        shutil.rmtree(run_dir, ignore_errors=True)
        raise CannotRun(
            f"no socket can be made in {run_dir}: {error}: set XDG_RUNTIME_DIR to another, short path"
        ) from None
    (run_dir / "cell.toml").write_text(cell_text, encoding="utf-8")
    regions = create(region_sizes(cell.period, len(cell.axes), len(cell.groups)))
    return Surroundings(
        run_dir=run_dir,
        regions=regions,
        control=Control(regions["control"].map(), len(cell.groups)),
        listening=listening,
        log={sender: _log_pair() for sender in LOG_SENDERS},
    )


def _listen(path: Path) -> socket.socket:
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        listening.bind(str(path))
        listening.listen(2)
    except OSError:
        listening.close()
        raise
    return listening


def _log_pair() -> tuple[socket.socket, socket.socket]:
    sender, receiver = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    sender.setblocking(False)
    receiver.setblocking(False)
    try:
        sender.setsockopt(socket.SOL_SOCKET, _SO_SNDBUFFORCE, LOG_BUFFER_BYTES)
    except PermissionError:
        sender.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, LOG_BUFFER_BYTES)
    return sender, receiver
