import asyncio
import threading

import pytest

from axisync_client.threads import in_thread

LONG_S = 20.0


def test_result_and_error() -> None:
    async def main() -> int:
        with pytest.raises(ZeroDivisionError):
            await in_thread(lambda: 1 // 0)
        return await in_thread(lambda: 7)

    assert asyncio.run(main()) == 7


def test_a_cancelled_wait_returns_at_once_and_its_late_result_is_undone() -> None:
    go, undone = threading.Event(), threading.Event()
    seen: list[int] = []

    def undo(result: int) -> None:
        seen.append(result)
        undone.set()

    async def main() -> None:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(in_thread(lambda: go.wait(LONG_S) and 7, undo), 0.05)
        assert not undone.is_set()
        go.set()

    asyncio.run(main())
    assert undone.wait(LONG_S)
    assert seen == [7]


def test_a_result_that_comes_together_with_the_cancellation_is_undone_too() -> None:
    done, undone = threading.Event(), threading.Event()

    async def main() -> None:
        def work() -> int:
            done.set()
            return 7

        task = asyncio.create_task(in_thread(work, lambda result: undone.set()))
        await asyncio.sleep(0)
        assert done.wait(LONG_S)
        while threading.active_count() > before:  # the thread has given its result, and the loop has not seen it
            pass
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    before = threading.active_count()
    asyncio.run(main())
    assert undone.wait(LONG_S)


def test_a_late_error_is_nobodys() -> None:
    go = threading.Event()

    def work() -> None:
        go.wait(LONG_S)
        raise ValueError

    async def main() -> None:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(in_thread(work, lambda result: pytest.fail("nothing to undo")), 0.05)

    asyncio.run(main())
    go.set()
