"""From Zenoh's threads to the actor: a queue and an eventfd that wakes the selector."""

import os
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")

CAPACITY = 512


class Inbox(Generic[T]):
    """Items put by any thread, taken by one. Full means refused: the sender can still answer, and nothing grows."""

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._items: deque[T] = deque()
        self._capacity = capacity
        self._event = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._closed = False

    def fileno(self) -> int:
        """Readable while there may be items."""
        return self._event

    def put(self, item: T) -> bool:
        """False where it is full or closed."""
        if self._closed or len(self._items) >= self._capacity:
            return False
        self._items.append(item)
        os.eventfd_write(self._event, 1)
        return True

    def take(self, most: int) -> list[T]:
        """The oldest items, at most `most`; more of them keep it readable."""
        try:
            os.eventfd_read(self._event)
        except BlockingIOError:
            return []
        items: list[T] = []
        while self._items and len(items) < most:
            items.append(self._items.popleft())
        if self._items:
            os.eventfd_write(self._event, 1)
        return items

    def close(self) -> None:
        """Takes nothing more. Zenoh's threads must have ended, or be about to find it closed."""
        self._closed = True
        os.close(self._event)
