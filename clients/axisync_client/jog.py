"""Hold-to-run: a group moves while a block runs, asked for again and again in the background."""

import time
from threading import Event, Lock, Thread
from types import TracebackType
from typing import Literal, Protocol, Self, TypeVar

from axisync_client import calls
from axisync_client.calls import Call
from axisync_client.errors import AxisyncError, InvalidArgument, Refused, Unavailable
from axisync_client.units import Floats, as_floats
from axisync_schemas.base import Strict
from axisync_schemas.errors import ErrorCode
from axisync_schemas.replies import JogReply

R = TypeVar("R", bound=Strict)
Space = Literal["joint", "tool", "base", "body"]

PERIOD_S = 0.06
REFRESHES_PER_TTL = 3
END_TIMEOUT_S = 10.0
NO_WAY = frozenset(
    {
        ErrorCode.SOFT_LIMIT,
        ErrorCode.JOINT_LIMIT,
        ErrorCode.COLLISION,
        ErrorCode.SINGULAR_PATH,
        ErrorCode.UNREACHABLE,
    }
)
"""Refusals that another velocity, or time, may mend: the jog goes on asking."""
PASSING = frozenset({ErrorCode.STALE, ErrorCode.BUSY, ErrorCode.RATE_LIMITED})


class Ask(Protocol):
    """Sends a command under the lease."""

    def __call__(self, call: Call[R], /) -> R: ...


class Jog:
    """Made by `Lease.jog`. A context manager: the group moves inside of the block, and stands when it is left.

        with lease.jog("kingkong", velocity=deg(5, 0, 0, 0, 0, 0)) as motion:
            time.sleep(1.0)
            motion.velocity = deg(-5, 0, 0, 0, 0, 0)
            time.sleep(1.0)

    When this program dies or hangs, the group stops after `ttl_s`.

    Attributes:
        reply: the newest; `reply.ahead` says what is in force and what the way ends at.
        blocked: why it does not move now although it is asked to; None while it does.
    """

    def __init__(self, ask: Ask, token: str, group: str, space: Space, velocity: Floats, ttl_s: float) -> None:
        self.group, self.space = group, space
        self.reply: JogReply | None = None
        self.blocked: Refused | None = None
        self._ask, self._token, self._ttl_s = ask, token, ttl_s
        self._velocity = as_floats(velocity, "velocity")
        self._failure: AxisyncError | None = None
        self._wake, self._over, self._lock = Event(), Event(), Lock()
        self._thread = Thread(target=self._run, name="axisync-jog", daemon=True)
        self._call(self._velocity)  # What no daemon would take is said before anything moves.

    @property
    def velocity(self) -> tuple[float, ...]:
        """What is asked for: rad/s, or m/s and rad/s. Set it to go on in another way."""
        return self._velocity

    @velocity.setter
    def velocity(self, velocity: Floats) -> None:
        self.check()
        values = as_floats(velocity, "velocity")
        if len(values) != len(self._velocity):
            raise InvalidArgument(f"velocity: {len(values)} values", f"{len(self._velocity)} are expected, as before")
        self._velocity = values
        self._wake.set()

    def check(self) -> None:
        """Does nothing while the jog is on.

        Raises:
            Refused, LeaseLost, Unavailable: why it is not.
        """
        if self._failure is not None:
            raise self._failure

    def sleep(self, seconds: float) -> None:
        """Waits, but no longer than the jog is on.

        Raises:
            Refused, LeaseLost, Unavailable: why it is not.
        """
        self._over.wait(seconds)
        self.check()

    def __enter__(self) -> Self:
        """Begins to move.

        Raises:
            Refused: with a fix where there is one; nothing moves then.
        """
        self._thread.start()
        try:
            self._hear(self._ask(self._call(self._velocity)))
        except BaseException:
            self._finish(quietly=True)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stops; returns when the group stands. A jog that has failed is told here, unless another error says more."""
        self._finish(quietly=kind is not None or self._failure is not None)
        if kind is None:
            self.check()

    def _finish(self, quietly: bool) -> None:
        self._over.set()
        self._wake.set()
        self._thread.join(END_TIMEOUT_S)  # A request under way must not come after the last one.
        try:
            zero = (0.0,) * len(self._velocity)
            self._ask(calls.jog(self.group, self.space, zero, self._ttl_s, self._token, END_TIMEOUT_S))
        except AxisyncError:
            if not quietly:
                raise

    def _call(self, velocity: tuple[float, ...], timeout_s: float | None = None) -> Call[JogReply]:
        return calls.jog(self.group, self.space, velocity, self._ttl_s, self._token, timeout_s)

    def _run(self) -> None:
        period_s = min(PERIOD_S, self._ttl_s / REFRESHES_PER_TTL)
        heard_s = time.monotonic()
        while not self._over.is_set():
            self._wake.wait(period_s)
            self._wake.clear()
            if self._over.is_set():
                return
            began_s = time.monotonic()
            if self._refresh():
                heard_s = began_s
            elif time.monotonic() - heard_s > END_TIMEOUT_S:
                self._fail(Unavailable("the daemon no longer answers the jog", "is axisyncd running?"))

    def _refresh(self) -> bool:
        """Asks once more; True where the daemon answered."""
        try:
            reply = self._ask(self._call(self._velocity, max(self._ttl_s, 0.2)))
        except Unavailable:
            return False
        except Refused as refusal:
            if refusal.code in NO_WAY:
                self.blocked = refusal
            elif refusal.code not in PASSING:
                self._fail(refusal)
        except AxisyncError as failure:
            self._fail(failure)
        else:
            self._hear(reply)
        return True

    def _hear(self, reply: JogReply) -> None:
        with self._lock:
            self.reply = reply
            if reply.state == "moving":
                self.blocked = None

    def _fail(self, failure: AxisyncError) -> None:
        self._failure = failure
        self._over.set()
