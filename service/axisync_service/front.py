"""The front process: `python -m axisync_service.front`. One thread, the actor, beside those of Zenoh.

Its loop waits for commands and queries (an eventfd), the controller's and the planner's sockets, and timers. Nothing
in it blocks, and no step should take more than 1 ms.
"""

import contextlib
import gc
import logging
import os
import selectors
import sys
import time
from collections.abc import Callable, Sequence

from pydantic import ValidationError
from pydantic_core import from_json

from axisync_schemas import topics
from axisync_schemas.enumerations import Phase
from axisync_schemas.errors import Refusal
from axisync_schemas.events import EventKind
from axisync_schemas.internal import CONTROLLER_MESSAGE, ControllerEvent, ControllerReply, PlanResult
from axisync_schemas.log_models import RequestLog
from axisync_schemas.memory import GroupWord, Mailbox, TimingRing, Word
from axisync_schemas.replies import CycleReport, Event
from axisync_schemas.tick_ring import TickRing, slots_for
from axisync_schemas.ticks import TickLayout
from axisync_service.actioner.actioner import Actioner
from axisync_service.actioner.ports import Answer, Incoming, Notice
from axisync_service.actioner.world import World
from axisync_service.hmi.items import Ask, Done
from axisync_service.hmi.recent import RecentEvents
from axisync_service.hmi.reports import StateReports, cycle_report, info
from axisync_service.hmi.server import Server
from axisync_service.hmi.session import ListenError
from axisync_service.hmi.stop import StopHandler
from axisync_service.links.effects import Effects
from axisync_service.links.held import Held
from axisync_service.links.log_sink import LogSink
from axisync_service.links.recorder_watch import RecorderWatch
from axisync_service.links.seqpacket import Link
from axisync_service.links.timers import Timers
from axisync_service.links.world_reader import WorldReader
from axisync_service.process import EXIT_CONFIGURATION, ProcessContext, start

log = logging.getLogger(__name__)

NICE = -5
SWITCH_INTERVAL_S = 0.0005
"""How long a thread may keep the interpreter while the stop callback wants it."""
HOUSEKEEPING_S = 0.02
HELD_POLL_S = 0.001
ITEMS_AT_ONCE = 4
"""Commands taken in one turn of the loop, so that timers and the other sockets get theirs within milliseconds."""
FRESH_TICKS = 2
TICKS_AT_ONCE = 100
"""More than this were not published in time; only the newest are."""
PATIENCE_NS = 5 * 10**9
"""How long a lone SIGTERM waits for the controller to be done."""


class Front:
    """Wires the network, the actioner and the other processes together."""

    def __init__(self, context: ProcessContext) -> None:
        """
        Raises:
            ListenError: the listen address is refused, or cannot be listened on.
        """
        self._context = context
        cell, control = context.cell, context.control
        self._selector = selectors.DefaultSelector()
        self._reader, self._ring = self._make_reader()
        self._timings = TimingRing(context.regions["timings"].map(writable=False))
        self._reports = StateReports(cell, control)
        self._held: Held[ControllerReply | ControllerEvent] = Held()
        self._sink = LogSink(context.sockets.get("log"))
        run, selector = context.run_dir, self._selector
        self._controller = Link("controller", run / "controller.sock", selector, self._on_controller, self._on_lost)
        self._planner = Link("planner", run / "planner.sock", selector, self._on_plan, self._on_planner_lost)
        self._recent = RecentEvents()
        self._sequence = dict.fromkeys(topics.PUBLISHED, 0)
        self._published_tick = control[Word.CONTROLLER_TICK]
        self._cycle: CycleReport | None = None
        self._stopping_since: int | None = None
        self._state_bytes, self._state_ns = b"", 0
        plans = context.regions["plans"].map(writable=False)
        effects = Effects(
            control, plans, self._controller, self._planner, self._sink, self._publish_event, context.parent
        )
        self._effects = effects
        mailbox = Mailbox(context.regions["recorder"].map(writable=False))
        self._recorder = RecorderWatch(control, mailbox, self._publish_event, effects.notice, time.monotonic_ns())
        stop_reader, _ = self._make_reader()
        stop = StopHandler(cell, control, lambda: stop_reader.read(time.monotonic_ns(), Phase.RUNNING, 0))
        epochs = tuple(control.group(i, GroupWord.LEASE_EPOCH) for i in range(len(cell.groups)))
        self.actioner = Actioner(cell, effects, epochs, _first_plan_id())
        # Last: from here on it must be closed, or the process would not end.
        self.server = Server(cell, context.listen, stop)
        self._selector.register(self.server.inbox, selectors.EVENT_READ, self._on_inbox)
        self._timers = self._make_timers()

    def _make_reader(self) -> tuple[WorldReader, TickRing]:
        cell, regions = self._context.cell, self._context.regions
        layout = TickLayout(len(cell.axes), len(cell.groups))
        ring = TickRing(regions["ticks"].map(writable=False), layout, slots_for(cell.period))
        status = Mailbox(regions["status"].map(writable=False))
        return WorldReader(cell, self._context.control, ring, status), ring

    def _make_timers(self) -> Timers:
        timers, now_ns = Timers(), time.monotonic_ns()
        timers.every(HOUSEKEEPING_S, self._housekeeping, now_ns)
        timers.every(1.0 / topics.SETPOINTS.rate_hz, self._publish_setpoints, now_ns)
        timers.every(1.0 / topics.STATE.rate_hz, self._publish_state, now_ns)
        timers.every(1.0 / topics.CYCLE.rate_hz, self._publish_cycle, now_ns)
        timers.every(1.0, self._say_losses, now_ns)
        return timers

    # --- the loop -----------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Serves until the service closes."""
        self._effects.notice(Notice(EventKind.PROCESS_STARTED, "front serves", details={"pid": os.getpid()}))
        while not self._over():
            self.step()

    def step(self) -> None:
        """Waits for what comes next, and does it. A fault of ours costs that one step."""
        wait_s = self._timers.wait_s(time.monotonic_ns())
        for key, _ in self._selector.select(min(wait_s, HELD_POLL_S) if self._held else wait_s):
            self._guarded(key.data)
        self._guarded(self._release)
        self._guarded(lambda: self._timers.run(time.monotonic_ns()))

    def _guarded(self, work: Callable[[], None]) -> None:
        try:
            work()
        except Exception:
            log.exception("step failed")

    def close(self) -> bool:
        """Closes everything; False where Zenoh did not end in time."""
        ended = self.server.close()
        self._controller.close()
        self._planner.close()
        self._sink.close()
        self._selector.close()
        return ended

    def _over(self) -> bool:
        phase = self._context.phase()
        if phase is not Phase.STOPPING:
            return phase is Phase.CLOSING
        now_ns = time.monotonic_ns()
        self._stopping_since = self._stopping_since or now_ns
        if self._context.control[Word.PHASE] == Phase.STOPPING and os.getppid() == self._context.parent:
            return False  # The supervisor says CLOSING when the drives are off.
        done = bool(self._context.control[Word.CONTROLLER_DONE])
        return done or now_ns - self._stopping_since > PATIENCE_NS

    def _look(self) -> World:
        """A new snapshot, which the actioner knows too."""
        since = self._controller.since_ns if self._controller.connected else None
        world = self._reader.read(time.monotonic_ns(), self._context.phase(), since)
        self.actioner.observe(world)
        return world

    # --- from the network ---------------------------------------------------------------------------------------

    def _on_inbox(self) -> None:
        for item in self.server.inbox.take(ITEMS_AT_ONCE):
            self._guarded(lambda item=item: self._on_item(item))  # type: ignore[misc]

    def _on_item(self, item: Incoming | Ask | Done) -> None:
        if isinstance(item, Incoming):
            self.actioner.on_command(item, self._look())
            self._forget_state()
        elif isinstance(item, Ask):
            item.respond(self._answer(item))
        else:
            self._log_done(item)

    def _answer(self, ask: Ask) -> Answer:
        try:
            if ask.name == "state":
                return Answer(self._recent_state(), is_error=False)
            if ask.name == "events":
                return Answer(self._recent.answer(time.monotonic_ns() / 1e9), is_error=False)
            if ask.name == "info":
                text = info(self._context.cell, str(self._context.log_dir)).model_dump_json()
                return Answer(text.encode(), is_error=False)
            world = self._look()
            return Answer(self.actioner.find_move(ask.rest, world.now_ns).model_dump_json().encode(), is_error=False)
        except Refusal as refusal:
            return Answer(refusal.body().model_dump_json().encode(), is_error=True)

    def _log_done(self, done: Done) -> None:
        entry = RequestLog(
            request_id=done.error.request_id if done.error is not None else None,
            user=done.user,
            verb=done.verb,
            body=_object(done.body),
            received_s=done.received_ns / 1e9,
            answered_s=done.answered_ns / 1e9,
            reply=_object(done.reply or b""),
            error=done.error,
        )
        if entry.reply is not None:
            entry = entry.model_copy(update={"request_id": entry.reply.get("request_id")})
        self._effects.log(topics.LOG_REQUESTS, entry.model_dump(mode="json"))

    # --- from controller and planner ----------------------------------------------------------------------------

    def _on_controller(self, packet: bytes) -> None:
        try:
            message = CONTROLLER_MESSAGE.validate_json(packet)
        except ValidationError as error:
            log.error("controller_message=malformed errors=%d", error.error_count())
            return
        tick = message.tick if isinstance(message, ControllerReply) else message.event.tick
        self._held.put(message, tick or 0, time.monotonic_ns())

    def _release(self) -> None:
        if not self._held:
            return
        due = self._held.due(self._context.control[Word.CONTROLLER_TICK], time.monotonic_ns())
        self._deliver(due)

    def _deliver(self, messages: list[ControllerReply | ControllerEvent]) -> None:
        for message in messages:
            self.actioner.on_controller(message, self._look())
            self._forget_state()
            if isinstance(message, ControllerEvent):
                self._publish_event(message.event)

    def _on_lost(self) -> None:
        self._deliver(self._held.all())
        self._look()

    def _on_plan(self, packet: bytes) -> None:
        self.actioner.on_plan(PlanResult.model_validate_json(packet), self._look())

    def _on_planner_lost(self) -> None:
        self._look()
        self.actioner.on_planner_down()

    # --- on time ------------------------------------------------------------------------------------------------

    def _housekeeping(self) -> None:
        now_ns = time.monotonic_ns()
        self._context.control[Word.FRONT_NS] = now_ns
        self._controller.on_time(now_ns)
        self._planner.on_time(now_ns)
        self._recorder.look(now_ns)
        world = self._look()
        self._context.control[Word.FRONT_READY] = int(world.up)
        self.actioner.on_time(world)

    def _publish_setpoints(self) -> None:
        newest = self._context.control[Word.CONTROLLER_TICK]
        first = max(self._published_tick + 1, newest - TICKS_AT_ONCE + 1)
        if newest < self._published_tick:  # Another controller has begun to count anew.
            first = newest
        records = [record for tick in range(first, newest + 1) if (record := self._ring.read(tick)) is not None]
        self._published_tick = newest
        if records:
            self.server.publish(topics.SETPOINTS, self._ring.layout.batch(records, self._number(topics.SETPOINTS)))

    def _publish_state(self) -> None:
        self.server.publish(topics.STATE, self._state(self._number(topics.STATE)))

    def _state(self, seq: int) -> bytes:
        world = self._look()
        holders = self.actioner.holders(world.now_ns)
        state = self._reports.state(world, holders, self.actioner.progress, self._cycle, seq)
        self._state_bytes, self._state_ns = state.model_dump_json().encode(), world.now_ns
        return self._state_bytes

    def _recent_state(self) -> bytes:
        """For queries: made again only where it is older than two ticks, so that a flood of them costs little."""
        if time.monotonic_ns() - self._state_ns <= FRESH_TICKS * self._context.cell.period_ns:
            return self._state_bytes
        return self._state(self._sequence[topics.STATE])

    def _forget_state(self) -> None:
        """Something has changed: whoever is told so and asks for the state must not see that of before."""
        self._state_ns = 0

    def _publish_cycle(self) -> None:
        control = self._context.control
        self._cycle = cycle_report(self._context.cell, control, self._timings, self._sequence[topics.CYCLE] + 1)
        if self._cycle is not None:
            self._number(topics.CYCLE)
            self.server.publish(topics.CYCLE, self._cycle.model_dump_json().encode())

    def _publish_event(self, event: Event) -> None:
        event = event.model_copy(update={"seq": self._number(topics.EVENTS)})
        payload = event.model_dump_json().encode()
        self._recent.add(event.seq, event.kind, payload)
        self.server.publish(topics.EVENTS, payload)

    def _number(self, topic: topics.Topic) -> int:
        self._sequence[topic] += 1
        return self._sequence[topic]

    def _say_losses(self) -> None:
        lost = self._sink.take_lost()
        if lost:
            what = f"{lost} log entries of front were lost: the recorder does not take them"
            self._effects.notice(Notice(EventKind.RECORDER_LOST, what, severity="warning", details={"lost": lost}))


def _object(body: bytes) -> dict[str, object] | None:
    try:
        data = from_json(body, cache_strings="keys")
    except ValueError:
        return None
    return data if isinstance(data, dict) else None


def _first_plan_id() -> int:
    """From the wall clock: ids go on growing over restarts, and stay below 2^53, which JSON carries exactly."""
    return time.time_ns() // 1_000_000 * 1000


def main(arguments: Sequence[str] | None = None) -> int:
    """Serves; an exit code of its own where the listen address cannot be served, which no new start would change."""
    context = start("front", arguments)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with contextlib.suppress(OSError):  # Where permitted: a stop should not wait for a planner or a recorder.
        os.setpriority(os.PRIO_PROCESS, 0, NICE)
    try:
        front = Front(context)
    except ListenError as error:
        print(f"axisyncd: {error}", file=sys.stderr)
        return EXIT_CONFIGURATION
    gc.collect()
    gc.freeze()
    result = 1
    try:
        front.run()
        result = 0
    finally:
        if not front.close():
            logging.shutdown()
            os._exit(result)  # A client's dead connection keeps Zenoh; nothing of ours is left to do.
    return result


if __name__ == "__main__":
    sys.exit(main())
