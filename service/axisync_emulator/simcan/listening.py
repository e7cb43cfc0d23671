"""Listening sockets in the file system: one server a path, and no trace of those that died."""

import socket
from pathlib import Path


class BusySocket(OSError):
    """Another process serves this path."""


def listen_at(path: Path) -> socket.socket:
    """A non-blocking listening SEQPACKET socket at `path`; one left behind by a dead process is replaced.

    Raises:
        BusySocket: the path is served.
        OSError: it cannot be made there.
    """
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        if path.is_socket():
            _remove_dead(path)
        sock.bind(str(path))
        sock.listen(16)
        sock.setblocking(False)
    except BusySocket:
        sock.close()
        raise
    except OSError as error:
        sock.close()
        raise OSError(f"{path}: {error.strerror or error}") from None
    return sock


def _remove_dead(path: Path) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
        probe.settimeout(1.0)
        try:
            probe.connect(str(path))
        except (ConnectionRefusedError, FileNotFoundError):
            path.unlink(missing_ok=True)
            return
        except OSError as error:
            raise BusySocket(f"{path}: {error}") from None
    raise BusySocket(f"{path} is served by another process")
