"""The only file here that talks Zenoh: a session in client mode, queries with time-outs, subscriptions that drop.

No Python callback is registered: Zenoh runs those on threads that are no daemons, and a session left open then keeps
the interpreter from ending. Subscriptions are drained by a daemon thread of our own instead.
"""

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from threading import Thread

import zenoh
from pydantic import ValidationError

from axisync_client.errors import TimedOut, Unavailable
from axisync_schemas.errors import ErrorBody

CONNECT_TIMEOUT_S = 5.0
GRACE_S = 1.0
"""How long a question is repeated while nobody is there to answer it: a restarting daemon is back by then."""
RETRY_PAUSE_S = 0.05
MIN_ATTEMPT_S = 0.5
RING = 256
"""Samples Zenoh keeps for a subscription before the oldest is dropped; the thread that drains it is rarely late."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What came back: a payload, or an error body."""

    payload: bytes
    error: ErrorBody | None


class Subscription:
    """A declared subscriber and the thread that hands its samples to `sink`."""

    def __init__(self, subscriber: "zenoh.Subscriber[zenoh.handlers.Handler[zenoh.Sample]]", sink: "Sink") -> None:
        self._subscriber = subscriber
        self._thread = Thread(target=self._drain, args=(sink,), name="axisync-stream", daemon=True)
        self._thread.start()

    def _drain(self, sink: "Sink") -> None:
        try:
            for sample in self._subscriber:
                sink(bytes(sample.payload))
        except zenoh.ZError:
            pass  # undeclared, or the session is closed: the end of the stream either way

    def close(self) -> None:
        """No sample is delivered after this returns."""
        self._subscriber.undeclare()  # type: ignore[no-untyped-call]  # stub without types
        self._thread.join(timeout=1.0)


Sink = Callable[[bytes], None]


class Link:
    """One Zenoh session to one endpoint. Reconnects by itself; queries in between are repeated for `GRACE_S`."""

    def __init__(self, endpoint: str) -> None:
        """Connects.

        Raises:
            Unavailable: nobody listens there, or it is no address.
        """
        self.endpoint = endpoint
        try:
            self._session = zenoh.open(_configuration(endpoint))
        except zenoh.ZError:
            raise Unavailable(
                f"nobody listens at {endpoint}",
                "start `axisyncd demo`, or give the daemon's address as endpoint or by AXISYNC_ENDPOINT",
            ) from None

    def close(self) -> None:
        """Ends the session; without this the process may hang at exit."""
        if not self._session.is_closed():
            self._session.close()  # type: ignore[no-untyped-call]  # stub without types

    def query(self, key: str, payload: bytes, timeout_s: float, *, urgent: bool = False) -> Answer:
        """The answer to one question, asked again with the same bytes when the first got lost.

        Raises:
            Unavailable: nobody answers for that key.
            TimedOut: somebody does, but not in time.
        """
        begin = time.monotonic()
        end, patience_end = begin + timeout_s, begin + min(timeout_s, GRACE_S)
        attempt_s = max(timeout_s / 2, min(timeout_s, MIN_ATTEMPT_S))
        somebody = False
        while True:
            left = end - time.monotonic()
            answer, there = self._once(key, payload, max(0.01, min(attempt_s, left)), urgent)
            somebody = somebody or there
            if answer is not None:
                return answer
            now = time.monotonic()
            if not somebody and now >= patience_end:
                raise Unavailable(f"nobody answers at {self.endpoint} for {key}", "is axisyncd running?")
            if somebody and now >= end - RETRY_PAUSE_S:
                raise TimedOut(f"no answer from {self.endpoint} for {key} within {timeout_s:g} s")
            time.sleep(RETRY_PAUSE_S)

    def _once(self, key: str, payload: bytes, timeout_s: float, urgent: bool) -> tuple[Answer | None, bool]:
        """The answer, if any, and whether anybody took the question."""
        somebody = False
        for reply in self._replies(key, payload, timeout_s, urgent):
            somebody = True
            if reply.ok is not None:
                return Answer(bytes(reply.ok.payload), None), True
            if reply.err is not None and (body := _error_body(bytes(reply.err.payload))) is not None:
                return Answer(b"", body), True
        return None, somebody

    def query_all(self, key: str, timeout_s: float) -> dict[str, bytes]:
        """Every answer to a question with wildcards, by the key of who gave it."""
        replies = self._replies(key, b"", timeout_s, urgent=False)
        return {str(reply.ok.key_expr): bytes(reply.ok.payload) for reply in replies if reply.ok is not None}

    def _replies(self, key: str, payload: bytes, timeout_s: float, urgent: bool) -> Iterator[zenoh.Reply]:
        try:
            yield from self._session.get(
                key,
                payload=payload,
                timeout=timeout_s,
                target=zenoh.QueryTarget.ALL,
                congestion_control=zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.REAL_TIME if urgent else zenoh.Priority.DATA,
                express=True,
            )
        except zenoh.ZError:
            raise Unavailable(f"the connection to {self.endpoint} is closed") from None

    def subscribe(self, key: str, sink: Sink) -> Subscription:
        """Hands every sample's payload to `sink`, on a thread of its own."""
        try:
            subscriber = self._session.declare_subscriber(key, zenoh.handlers.RingChannel(RING))
        except zenoh.ZError:
            raise Unavailable(f"the connection to {self.endpoint} is closed") from None
        return Subscription(subscriber, sink)


def _configuration(endpoint: str) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in _CONFIGURATION.items():
        config.insert_json5(key, json.dumps(value))
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    return config


_CONFIGURATION: dict[str, object] = {
    "mode": "client",
    "connect/timeout_ms": 0,  # one attempt, then an error; what follows holds for reconnecting
    "connect/exit_on_failure": True,
    "connect/retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2},
    "listen/endpoints": [],
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "transport/shared_memory/enabled": False,
    "transport/unicast/open_timeout": round(CONNECT_TIMEOUT_S * 1000),
}


def _error_body(payload: bytes) -> ErrorBody | None:
    """None for what is not the daemon's: Zenoh reports its own time-outs as error replies, too."""
    try:
        return ErrorBody.model_validate_json(payload)
    except ValidationError:
        return None
