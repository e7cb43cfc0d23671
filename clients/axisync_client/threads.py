"""Blocking work awaited: each piece on a daemon thread of its own, which never keeps a program from ending.

asyncio's own executor is not used, since the interpreter waits for its threads at exit.
"""

import asyncio
import functools
from collections.abc import Callable, Coroutine, Generator
from concurrent.futures import Future, InvalidStateError
from contextlib import suppress
from threading import Thread
from types import TracebackType
from typing import Any, Concatenate, Generic, ParamSpec, Protocol, TypeVar

P = ParamSpec("P")
T = TypeVar("T")
B = TypeVar("B")


class Managed(Protocol):
    """What can stand behind `async with`."""

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


M = TypeVar("M", bound=Managed)


async def in_thread(work: Callable[[], T], undo: Callable[[T], object] | None = None) -> T:
    """The result of `work`. Cancelled, it returns at once, while the work goes on to its end or its time-out.

    Args:
        undo: given a result that nobody waits for any more; on a thread, too.
    """
    future: Future[T] = Future()
    Thread(target=_settle, args=(future, work, undo), name="axisync-call", daemon=True).start()
    try:
        return await asyncio.wrap_future(future)
    except asyncio.CancelledError:
        if not future.cancel() and undo is not None and future.exception() is None:
            Thread(target=undo, args=(future.result(),), name="axisync-undo", daemon=True).start()
        raise


def _settle(future: "Future[T]", work: Callable[[], T], undo: Callable[[T], object] | None) -> None:
    try:
        result = work()
    except BaseException as error:
        with suppress(InvalidStateError):
            future.set_exception(error)
        return
    try:
        future.set_result(result)
    except InvalidStateError:  # cancelled: nobody waits any more
        if undo is not None:
            undo(result)


class Shadow(Generic[B]):
    """An asynchronous object in front of a blocking one."""

    _blocking: B


def asynchronous(method: Callable[Concatenate[B, P], T]) -> Callable[Concatenate[Shadow[B], P], Coroutine[Any, Any, T]]:
    """The method of the blocking object as one of its shadow: same name, arguments, result, errors and docstring."""

    @functools.wraps(method)
    async def call(self: Shadow[B], /, *args: P.args, **kwargs: P.kwargs) -> T:
        blocking = self._blocking
        return await in_thread(lambda: method(blocking, *args, **kwargs))

    return call


class Opening(Generic[M]):
    """Something on its way: `await` it, or open and close it by `async with`."""

    def __init__(self, open_it: Callable[[], Coroutine[Any, Any, M]]) -> None:
        self._open = open_it
        self._opened: M | None = None

    def __await__(self) -> Generator[Any, None, M]:
        return self._open().__await__()

    async def __aenter__(self) -> M:
        self._opened = await self._open()
        return self._opened

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._opened is not None:
            await self._opened.__aexit__(kind, error, trace)
