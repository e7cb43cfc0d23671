"""A log of every frame, as `candump -L` writes it: `(seconds) bus ID#DATA`, seconds of bus time at the frame's end."""

from pathlib import Path

from axisync_emulator.simcan.wire import EXTENDED, EXTENDED_MASK, REMOTE

_BUFFER_BYTES = 1 << 18


class Candump:
    """Buffered; lines of several buses are each in order, but may be a little out of order among each other.

    Raises:
        OSError: the file cannot be opened or written.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", buffering=_BUFFER_BYTES, encoding="ascii")

    def write(self, bus: str, can_id: int, data: bytes, now: int) -> None:
        """One frame that ended at `now` ns."""
        identifier = f"{can_id & EXTENDED_MASK:08X}" if can_id & EXTENDED else f"{can_id:03X}"
        text = f"R{len(data) or ''}" if can_id & REMOTE else data.hex().upper()
        if can_id & REMOTE and not can_id & EXTENDED:
            identifier = f"{can_id & 0x7FF:03X}"
        self._file.write(f"({now // 1_000_000_000}.{now // 1000 % 1_000_000:06d}) {bus} {identifier}#{text}\n")

    def flush(self) -> None:
        """Lets readers see all of it."""
        self._file.flush()

    def close(self) -> None:
        """Ends the file."""
        self._file.close()
