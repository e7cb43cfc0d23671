"""Inbox and outbox: bounded, and never in anybody's way."""

import select
import threading
import time

from axisync_service.hmi.inbox import Inbox
from axisync_service.hmi.outbox import MAX_REPLIES, MAX_SAMPLES, Outbox


def readable(inbox: Inbox[int]) -> bool:
    return bool(select.select([inbox], [], [], 0.0)[0])


def test_items_come_in_order_and_wake_the_selector() -> None:
    inbox: Inbox[int] = Inbox()
    assert not readable(inbox)
    for i in range(5):
        assert inbox.put(i)
    assert readable(inbox)
    assert inbox.take(3) == [0, 1, 2]
    assert readable(inbox), "there is more"
    assert inbox.take(3) == [3, 4]
    assert not readable(inbox)
    assert inbox.take(3) == []
    inbox.close()


def test_a_full_inbox_refuses() -> None:
    inbox: Inbox[int] = Inbox(capacity=2)
    assert [inbox.put(i) for i in range(3)] == [True, True, False]
    inbox.take(1)
    assert inbox.put(3)
    inbox.close()
    assert not inbox.put(4)


def test_what_is_sent_is_sent_in_order_by_another_thread() -> None:
    outbox, sent = Outbox(), []
    for i in range(100):
        outbox.reply(lambda i=i: sent.append((i, threading.current_thread().name)))  # type: ignore[misc]
    assert outbox.close(5.0)
    assert sent == [(i, "outbox") for i in range(100)]
    assert outbox.dropped == 0


def test_a_blocked_client_costs_samples_first_and_never_time() -> None:
    outbox, gate, sent = Outbox(), threading.Event(), []
    outbox.reply(lambda: sent.append(gate.wait(10.0)))
    time.sleep(0.05)
    before = time.perf_counter()
    for i in range(MAX_SAMPLES + 10):
        outbox.publish(lambda i=i: sent.append(i))  # type: ignore[misc]
    for i in range(MAX_REPLIES):
        outbox.reply(lambda i=i: sent.append(i))  # type: ignore[misc]
    assert time.perf_counter() - before < 1.0
    assert outbox.dropped == 10 + MAX_SAMPLES
    assert not outbox.close(0.05)
    gate.set()
    assert outbox.close(5.0)
    assert len(sent) == 1 + MAX_REPLIES


def test_a_failure_to_send_is_one_dropped_item() -> None:
    outbox, sent = Outbox(), []

    def fails() -> None:
        raise RuntimeError("the client has gone")

    outbox.reply(fails)
    outbox.reply(lambda: sent.append(1))
    assert outbox.close(5.0)
    assert sent == [1]
    assert outbox.dropped == 1
