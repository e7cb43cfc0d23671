"""Where commands are taken in and answered: idempotency, the log of requests, and refusals as replies."""

import hashlib
import logging
from dataclasses import dataclass
from typing import Any

from axisync_schemas.commands import Request
from axisync_schemas.errors import ErrorBody, ErrorCode, Refusal
from axisync_schemas.events import EventKind
from axisync_schemas.log_models import RequestLog
from axisync_schemas.replies import Reply
from axisync_schemas.topics import LOG_REQUESTS
from axisync_service.actioner.idempotency import Idempotency, Key
from axisync_service.actioner.ports import Answer, Incoming, Notice, Ports
from axisync_service.actioner.rate import RateLimiter
from axisync_service.actioner.requests import Unreadable

log = logging.getLogger(__name__)

_TOKEN_SHOWN = 6


@dataclass(frozen=True, slots=True)
class Call:
    """One command in work."""

    verb: str
    user: str
    request: Request
    received_ns: int

    @property
    def request_id(self) -> str:
        """As in every reply."""
        return str(self.request.request_id)

    @property
    def key(self) -> Key:
        """What makes two commands the same."""
        return self.user, self.request.request_id


class Desk:
    """Answers each command exactly once, and keeps the answers."""

    def __init__(self, ports: Ports) -> None:
        self._ports = ports
        self._known = Idempotency()
        self._refusal_events = RateLimiter(rate_hz=5.0, burst=20.0)

    def open(self, incoming: Incoming, request: Request, now_ns: int) -> Call | None:
        """The command to carry out, or None where it is a repetition, which gets the first one's answer."""
        call = Call(incoming.verb, incoming.user, request, incoming.received_ns)
        text = f"{incoming.verb} {request.model_dump_json()}"
        fingerprint = hashlib.sha256(text.encode()).digest()
        try:
            return call if self._known.begin(call.key, fingerprint, incoming.respond, now_ns) else None
        except Refusal as refusal:
            self.reject(incoming, refusal, call.request_id, now_ns)
            return None

    def reply(self, call: Call, reply: Reply, now_ns: int) -> None:
        """The command was carried out, or accepted."""
        self._known.finish(call.key, Answer(reply.model_dump_json().encode(), is_error=False))
        self._record(call, now_ns, reply=reply)

    def refuse(self, call: Call, refusal: Refusal, now_ns: int) -> None:
        """The command is not carried out."""
        body = refusal.body(call.request_id)
        self._known.finish(call.key, Answer(body.model_dump_json().encode(), is_error=True))
        self._record(call, now_ns, error=body)
        self._tell(call.user, call.verb, refusal, call.request_id, now_ns)

    def fail(self, call: Call, error: Exception, now_ns: int) -> None:
        """A fault of ours: the user learns its kind, the log where."""
        log.error("command failed verb=%s request_id=%s", call.verb, call.request_id, exc_info=error)
        self.refuse(call, Refusal(ErrorCode.INTERNAL, f"internal error: {type(error).__name__}"), now_ns)

    def reject(self, incoming: Incoming, refusal: Refusal, request_id: str | None, now_ns: int) -> None:
        """A command that could not be read, or whose request_id is taken; not kept."""
        body = refusal.body(request_id)
        incoming.respond(Answer(body.model_dump_json().encode(), is_error=True))
        self._log(incoming.user, incoming.verb, request_id, None, incoming.received_ns, now_ns, error=body)
        self._tell(incoming.user, incoming.verb, refusal, request_id, now_ns)

    def unreadable(self, incoming: Incoming, refusal: Unreadable, now_ns: int) -> None:
        """A command that is no request."""
        self.reject(incoming, refusal, refusal.request_id, now_ns)

    def _record(self, call: Call, now_ns: int, reply: Reply | None = None, error: ErrorBody | None = None) -> None:
        body = _masked(call.request.model_dump(mode="json", by_alias=True))
        self._log(call.user, call.verb, call.request_id, body, call.received_ns, now_ns, reply, error)

    def _log(
        self, user: str, verb: str, request_id: str | None, body: dict[str, Any] | None, received_ns: int,
        now_ns: int, reply: Reply | None = None, error: ErrorBody | None = None,
    ) -> None:  # fmt: skip
        entry = RequestLog(
            request_id=request_id,
            user=user,
            verb=verb,
            body=body,
            received_s=received_ns / 1e9,
            answered_s=now_ns / 1e9,
            reply=_masked(reply.model_dump(mode="json")) if reply is not None else None,
            error=error,
        )
        self._ports.log(LOG_REQUESTS, entry.model_dump(mode="json"))

    def _tell(self, user: str, verb: str, refusal: Refusal, request_id: str | None, now_ns: int) -> None:
        if not self._refusal_events.allow(user, now_ns):
            return
        message = f"{verb} refused: {refusal.code}: {refusal.message}"
        details = {"user": user, "verb": verb, "code": str(refusal.code), "request_id": request_id}
        self._ports.notice(Notice(EventKind.REQUEST_REFUSED, message, severity="warning", details=details))


def _masked(body: dict[str, Any]) -> dict[str, Any]:
    """Without the rest of a lease token: who reads the log must not get the lease."""
    token = body.get("lease")
    return body | {"lease": f"{token[:_TOKEN_SHOWN]}..."} if isinstance(token, str) else body
