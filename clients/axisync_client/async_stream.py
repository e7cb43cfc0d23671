"""Published streams for asyncio: `streams.Stream`, awaited."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Generic, Self, TypeVar

from axisync_client.streams import Stream
from axisync_client.threads import in_thread

T = TypeVar("T")


class AsyncStream(Generic[T]):
    """Asynchronous iterator over a topic; also a context manager. Ends when it or its client is closed.

    Subscribed from `async with` on, or from the first message that is awaited. What a slow reader leaves is dropped,
    the oldest first; a cancelled wait loses nothing.
    """

    def __init__(self, subscribe: Callable[[], Stream[T]]) -> None:
        self._subscribe = subscribe
        self._stream: Stream[T] | None = None
        self._news = asyncio.Event()

    @property
    def missed(self) -> int:
        """Messages that were published and did not get here, by their numbers."""
        return 0 if self._stream is None else self._stream.missed

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> T:
        """The next message.

        Raises:
            StopAsyncIteration: closed.
            Unavailable: the daemon is gone, or a periodic stream went silent.
            UnexpectedReply: the message is of another schema.
        """
        stream = await self._opened()
        while True:
            self._news.clear()
            closed = stream.closed
            message = stream.poll()
            if message is not None:
                return message
            if closed:
                raise StopAsyncIteration
            await self._wait(stream)

    async def _wait(self, stream: Stream[T]) -> None:
        try:
            async with asyncio.timeout(stream.silence_s):
                await self._news.wait()
        except TimeoutError:
            await in_thread(stream.inquire)

    async def _opened(self) -> Stream[T]:
        if self._stream is None:
            self._stream = await in_thread(self._subscribe, undo=Stream.close)
            loop = asyncio.get_running_loop()
            self._stream.notify(lambda: self._wake(loop))
        return self._stream

    def _wake(self, loop: asyncio.AbstractEventLoop) -> None:
        """On the thread of the subscription."""
        if not self._news.is_set():
            with suppress(RuntimeError):  # the loop is closed: nobody waits
                loop.call_soon_threadsafe(self._news.set)

    async def close(self) -> None:
        """Unsubscribes; who waits gets StopAsyncIteration. May be called twice."""
        if self._stream is not None:
            await in_thread(self._stream.close)

    async def __aenter__(self) -> Self:
        await self._opened()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()
