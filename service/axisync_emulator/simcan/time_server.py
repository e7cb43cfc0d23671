"""The hub's side of lock-step time: who takes part, who waits until when. The protocol is in `timing`."""

import socket
from dataclasses import dataclass
from pathlib import Path

from axisync_emulator.simcan.hub import peer_pid
from axisync_emulator.simcan.listening import listen_at
from axisync_emulator.simcan.protocol import AT, WAIT


@dataclass(slots=True)
class Participant:
    """A process that takes part. `until` is None while it runs."""

    sock: socket.socket
    pid: int
    until: int | None = None
    wake_on_frame: bool = False

    def fileno(self) -> int:
        """For select."""
        return self.sock.fileno()


class TimeServer:
    """Keeps the participants; the loop that moves the buses asks it when.

    Raises:
        BusySocket: the path is served by another process.
    """

    def __init__(self, path: Path, start_ns: int, expected: int = 1) -> None:
        self.path = path
        self.now = start_ns
        self.listener = listen_at(path)
        self.participants: list[Participant] = []
        self._expected = expected

    def accept(self) -> None:
        """Takes whoever has connected, and tells the time."""
        while True:
            try:
                sock, _ = self.listener.accept()
            except BlockingIOError:
                return
            participant = Participant(sock, peer_pid(sock))
            self.participants.append(participant)
            self._expected -= 1
            self._tell(participant)

    def read(self, participant: Participant) -> None:
        """Takes one WAIT; one who has gone no longer counts."""
        try:
            packet = participant.sock.recv(WAIT.size + 1)
        except OSError:
            packet = b""
        if len(packet) != WAIT.size:
            self._drop(participant)
            return
        until, wake = WAIT.unpack(packet)
        participant.until = max(until, self.now)
        participant.wake_on_frame = bool(wake)

    @property
    def all_wait(self) -> bool:
        """Time may move: everyone expected has come, and everyone here waits."""
        return bool(self.participants) and self._expected <= 0 and all(p.until is not None for p in self.participants)

    @property
    def earliest(self) -> int:
        """The first time anyone waits for; only while `all_wait`."""
        return min(p.until for p in self.participants if p.until is not None)

    @property
    def wakeable(self) -> frozenset[int]:
        """Process ids of those whom a frame wakes."""
        return frozenset(p.pid for p in self.participants if p.wake_on_frame)

    def grant(self, now: int, woken: frozenset[int]) -> None:
        """It is `now`: answers those who waited for it, and those woken by a frame."""
        self.now = now
        for participant in tuple(self.participants):
            if participant.until is None:
                continue
            if participant.until <= now or (participant.wake_on_frame and participant.pid in woken):
                participant.until = None
                self._tell(participant)

    def _tell(self, participant: Participant) -> None:
        try:
            participant.sock.send(AT.pack(self.now))
        except OSError:
            self._drop(participant)

    def _drop(self, participant: Participant) -> None:
        participant.sock.close()
        self.participants.remove(participant)

    def close(self) -> None:
        """Ends it; whoever waits sees the end."""
        for participant in tuple(self.participants):
            self._drop(participant)
        self.listener.close()
        self.path.unlink(missing_ok=True)
