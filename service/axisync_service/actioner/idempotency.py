"""Same user, request_id and body: the same answer, never a second motion."""

from collections import OrderedDict
from dataclasses import dataclass, field
from itertools import islice
from uuid import UUID

from axisync_schemas.errors import ErrorCode, Refusal
from axisync_service.actioner.ports import Answer, Respond

KEEP_NS = 600 * 10**9
KEEP_AT_MOST = 10_000
KEEP_BYTES = 32 * 1024 * 1024
"""Of answers: that of a long program may have 100 KiB."""
LOOKED_AT = 64
"""Oldest entries looked at in each turn: many small ones make room for a large one; one in progress keeps no other."""

Key = tuple[str, UUID]


@dataclass(slots=True)
class Entry:
    """One request: its answer, or who waits for it."""

    fingerprint: bytes
    since_ns: int
    answer: Answer | None = None
    waiting: list[Respond] = field(default_factory=list)


class Idempotency:
    """The newest requests and their answers: 10 minutes, at most 10,000 and 32 MiB."""

    def __init__(self) -> None:
        self._entries: OrderedDict[Key, Entry] = OrderedDict()
        self._bytes = 0

    def __len__(self) -> int:
        return len(self._entries)

    def begin(self, key: Key, fingerprint: bytes, respond: Respond, now_ns: int) -> bool:
        """True where the request is new and must be carried out; otherwise `respond` gets the first one's answer.

        Raises:
            Refusal: INVALID_REQUEST, the request_id belongs to another request.
        """
        self._forget(now_ns)
        entry = self._entries.get(key)
        if entry is None:
            self._entries[key] = Entry(fingerprint, now_ns, waiting=[respond])
            return True
        if entry.fingerprint != fingerprint:
            message = "request_id: already used for another request"
            fault = {"path": "request_id", "message": message, "value": str(key[1])}
            raise Refusal(ErrorCode.INVALID_REQUEST, message, errors=[fault])
        if entry.answer is None:
            entry.waiting.append(respond)
        else:
            respond(entry.answer)
        return False

    def finish(self, key: Key, answer: Answer) -> None:
        """Answers everybody who asked, now and later."""
        entry = self._entries.get(key)
        if entry is None:
            return
        entry.answer = answer
        self._bytes += len(answer.payload)
        waiting, entry.waiting = entry.waiting, []
        for respond in waiting:
            respond(answer)

    def _forget(self, now_ns: int) -> None:
        """Drops what is too old or too much; a request in progress stays, however old."""
        for key, entry in list(islice(self._entries.items(), LOOKED_AT)):
            too_much = len(self._entries) >= KEEP_AT_MOST or self._bytes > KEEP_BYTES
            if entry.since_ns > now_ns - KEEP_NS and not too_much:
                return
            if entry.answer is not None:
                del self._entries[key]
                self._bytes -= len(entry.answer.payload)
