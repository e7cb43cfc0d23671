"""One drive's SDO channel after bring-up: transfers one after the other, whoever asks for them."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from axisync_service.canopen.sdo import SdoClient, SdoError

Done = Callable[[bytes | SdoError], None]
"""Takes the bytes read (b"" of a write), or why not."""
LOST = 0x05040000


@dataclass(frozen=True, slots=True)
class Transfer:
    """A read, or a write of `data`."""

    index: int
    sub: int
    data: bytes | None
    done: Done


class SdoChannel:
    """Feeds a client. `step` is called each tick while it is busy.

    Attributes:
        busy: something waits or is under way.
    """

    def __init__(self) -> None:
        self.busy = False
        self._waiting: deque[Transfer] = deque()
        self._current: Transfer | None = None

    def read(self, index: int, sub: int, done: Done) -> None:
        """Asks for an object."""
        self._add(Transfer(index, sub, None, done))

    def write(self, index: int, sub: int, data: bytes, done: Done = lambda _: None) -> None:
        """Writes an object."""
        self._add(Transfer(index, sub, data, done))

    def _add(self, transfer: Transfer) -> None:
        self._waiting.append(transfer)
        self.busy = True

    def step(self, client: SdoClient) -> None:
        """Hands over the answer that has come, and begins with the next transfer."""
        if not client.idle:
            return
        current, self._current = self._current, None
        if current is not None and client.result is not None:
            current.done(client.result)  # May ask for more.
        if self._waiting:
            self._current = self._waiting.popleft()
            if self._current.data is None:
                client.upload(self._current.index, self._current.sub)
            else:
                client.download(self._current.index, self._current.sub, self._current.data)
        self.busy = self._current is not None

    def close(self) -> None:
        """The drive is lost: everything that waits is answered with a time-out."""
        lost = [*([self._current] if self._current else []), *self._waiting]
        self._current = None
        self._waiting.clear()
        self.busy = False
        for transfer in lost:
            transfer.done(SdoError(LOST))
