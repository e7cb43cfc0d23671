"""Queryables and publishers. Each queryable has a callback thread of its own, so nothing queues before `stop`."""

import contextlib
import json
import logging
import threading
import time
from collections.abc import Callable
from typing import Any

import zenoh

from axisync_schemas import keys, topics
from axisync_schemas.cell import Cell
from axisync_schemas.errors import ErrorBody, ErrorCode, Refusal
from axisync_schemas.export import MODELS, schema
from axisync_service.actioner.ports import Answer, Incoming, Respond
from axisync_service.hmi.door import Door, is_wildcard
from axisync_service.hmi.inbox import Inbox
from axisync_service.hmi.items import Ask, Done, Item
from axisync_service.hmi.outbox import Outbox
from axisync_service.hmi.session import open_session

log = logging.getLogger(__name__)

CLOSE_S = 2.0
ENCODINGS = {"json": "application/json", "protobuf": "application/protobuf"}
PRIORITIES = {topics.EVENTS.name: zenoh.Priority.DATA}
"""Priority of each topic; the others' is DATA_LOW, so that telemetry never stands before a reply."""

ASKERS = "all queries"
"""Queries carry no user; they share one rate."""

Stop = Callable[[bytes], Answer]


class Server:
    """The daemon on the network.

    Attributes:
        inbox: commands and queries for the actor.
    """

    def __init__(self, cell: Cell, listen: str, stop: Stop) -> None:
        """
        Raises:
            ListenError: the address is refused, or cannot be listened on.
        """
        self.inbox: Inbox[Item] = Inbox()
        self._cell = cell
        self._stop = stop
        self._door = Door()
        self._static = {"config": {"": cell.model_dump_json(by_alias=True).encode()}, "schema": _schemas()}
        self._session = open_session(listen)
        self._outbox = Outbox()
        try:
            self._declare()
        except BaseException:
            self._close_session()  # Left open it would keep the process from ending.
            raise

    def _declare(self) -> None:
        name, declare = self._cell.name, self._session.declare_queryable
        self._queryables = [
            declare(keys.command(name, "*", verb), self._guarded(self._on_command(verb)))
            for verb in keys.VERBS
            if verb != "stop"
        ]
        self._queryables.append(declare(keys.command(name, "*", "stop"), self._guarded(self._on_stop)))
        for topic, handler in (
            ("state", self._on_ask("state")), ("info", self._on_ask("info")), ("moves/*", self._on_ask("moves")),
            ("events", self._on_ask("events")),
            ("config", self._on_static("config")), ("schema/*", self._on_static("schema")),
        ):  # fmt: skip
            self._queryables.append(declare(keys.topic(name, topic), self._guarded(handler)))
        self._publishers = {
            topic.name: self._session.declare_publisher(
                keys.topic(name, topic.name),
                encoding=ENCODINGS[topic.encoding],
                congestion_control=zenoh.CongestionControl.DROP,
                priority=PRIORITIES.get(topic.name, zenoh.Priority.DATA_LOW),
            )
            for topic in topics.PUBLISHED
        }
        self._alive = self._session.liveliness().declare_token(keys.topic(name, topics.ALIVE))

    # --- outward ------------------------------------------------------------------------------------------------

    def publish(self, topic: topics.Topic, payload: bytes) -> None:
        """Publishes a sample; never waits, drops rather."""
        publisher = self._publishers[topic.name]
        self._outbox.publish(lambda: publisher.put(payload))

    @property
    def dropped(self) -> int:
        """Samples and replies that could not be sent."""
        return self._outbox.dropped

    def close(self) -> bool:
        """Sends what is queued and closes the session; False where Zenoh did not end in time."""
        self._outbox.close(CLOSE_S / 2)
        closer = threading.Thread(target=self._close_session, name="closer", daemon=True)
        closer.start()
        closer.join(CLOSE_S)
        if closer.is_alive():
            return False
        self.inbox.close()
        return True

    def _close_session(self) -> None:
        with contextlib.suppress(zenoh.ZError):
            self._session.close()  # type: ignore[no-untyped-call]

    # --- callbacks: in Zenoh's threads --------------------------------------------------------------------------

    def _guarded(self, handler: Callable[[zenoh.Query], None]) -> Callable[[zenoh.Query], None]:
        """A callback that raises looks to the client as if nobody were there; so none does."""

        def callback(query: zenoh.Query) -> None:
            try:
                handler(query)
            except Exception as error:
                log.exception("callback failed")
                refusal = Refusal(ErrorCode.INTERNAL, f"internal error: {type(error).__name__}")
                self._respond(query, "")(_refused(refusal.body()))

        return callback

    def _on_command(self, verb: str) -> Callable[[zenoh.Query], None]:
        def handler(query: zenoh.Query) -> None:
            received_ns, key = time.monotonic_ns(), str(query.key_expr)
            respond = self._respond(query, key)
            try:
                user = self._door.user(key)
                body = self._body(query)
                self._door.check_rate(user, received_ns)
            except Refusal as refusal:
                self._turn_away(verb, key, refusal, respond, received_ns)
                return
            if not self.inbox.put(Incoming(verb, user, body, respond, received_ns)):
                self._turn_away(verb, key, _full(), respond, received_ns)

        return handler

    def _on_stop(self, query: zenoh.Query) -> None:
        received_ns, key = time.monotonic_ns(), str(query.key_expr)
        try:
            user = self._door.user(key)
            body = self._body(query)
        except Refusal as refusal:
            self._turn_away("stop", key, refusal, self._respond(query, key), received_ns)
            return
        answer = self._stop(body)
        answered_ns = time.monotonic_ns()
        _send(query, key, answer)
        error = ErrorBody.model_validate_json(answer.payload) if answer.is_error else None
        reply = None if answer.is_error else answer.payload
        self.inbox.put(Done("stop", user, body, reply, error, received_ns, answered_ns))

    def _turn_away(self, verb: str, key: str, refusal: Refusal, respond: Respond, received_ns: int) -> None:
        body = refusal.body()
        respond(_refused(body))
        if refusal.code is not ErrorCode.RATE_LIMITED:
            user = keys.user_of(key) or "?"
            self.inbox.put(Done(verb, user, b"", None, body, received_ns, time.monotonic_ns()))

    def _on_ask(self, name: str) -> Callable[[zenoh.Query], None]:
        def handler(query: zenoh.Query) -> None:
            key = str(query.key_expr)
            if name == "moves":
                rest = "" if is_wildcard(key) else key.rsplit("/", 1)[1]
                respond = self._respond(query, key)
            else:
                rest, respond = "", self._respond(query, keys.topic(self._cell.name, name))
            try:
                self._door.check_rate(ASKERS, time.monotonic_ns())
                if not self.inbox.put(Ask(name, rest, respond)):
                    raise _full()
            except Refusal as refusal:
                respond(_refused(refusal.body()))

        return handler

    def _on_static(self, name: str) -> Callable[[zenoh.Query], None]:
        table = {keys.topic(self._cell.name, f"{name}/{k}".rstrip("/")): v for k, v in self._static[name].items()}

        def handler(query: zenoh.Query) -> None:
            found = [(key, body) for key, body in table.items() if query.key_expr.intersects(key)]
            try:
                self._door.check_rate(ASKERS, time.monotonic_ns())
                if not found:
                    raise Refusal(ErrorCode.NOT_FOUND, f"no such {name}", names=sorted(self._static[name]))
            except Refusal as refusal:
                self._respond(query, "")(_refused(refusal.body()))
                return
            self._outbox.reply(lambda: _send_all(query, found))

        return handler

    @staticmethod
    def _body(query: zenoh.Query) -> bytes:
        payload = query.payload
        if payload is None:
            return b""
        Door.check_size(len(payload))
        return payload.to_bytes()

    def _respond(self, query: zenoh.Query, key: str) -> Respond:
        return lambda answer: self._outbox.reply(lambda: _send(query, key, answer))


def _send(query: zenoh.Query, key: str, answer: Answer) -> None:
    with query:
        if answer.is_error:
            query.reply_err(answer.payload, encoding=ENCODINGS["json"])
        else:
            query.reply(key, answer.payload, encoding=ENCODINGS["json"])


def _send_all(query: zenoh.Query, found: list[tuple[str, bytes]]) -> None:
    with query:
        for key, body in found:
            query.reply(key, body, encoding=ENCODINGS["json"])


def _refused(body: ErrorBody) -> Answer:
    return Answer(body.model_dump_json().encode(), is_error=True)


def _full() -> Refusal:
    return Refusal(ErrorCode.RATE_LIMITED, "too many requests are waiting")


def _schemas() -> dict[str, bytes]:
    """JSON Schema of each model a client can meet, made once: that takes milliseconds."""
    texts: dict[str, Any] = {model.__name__: schema(model) for model in MODELS}
    return {name: json.dumps(text).encode() for name, text in texts.items()}
