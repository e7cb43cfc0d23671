"""Work ahead in a thread of its own: unpacking, checksums and numpy let another thread run meanwhile."""

from collections import deque
from collections.abc import Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")


def ahead(items: Iterator[T], depth: int) -> Generator[T, None, None]:
    """The same items in the same order, each made while those before it are being used; `depth` wait at most.

    What making one raises is raised where it would have come.
    """
    with ThreadPoolExecutor(1, "ahead") as pool:
        waiting: deque[Future[T]] = deque(pool.submit(next, items) for _ in range(depth))
        while True:
            try:
                item = waiting.popleft().result()
            except StopIteration:
                return
            waiting.append(pool.submit(next, items))
            yield item
