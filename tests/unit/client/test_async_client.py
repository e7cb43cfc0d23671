import asyncio
import inspect
import time
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from axisync_client import (
    AsyncClient,
    AsyncJog,
    AsyncLease,
    AsyncMove,
    Client,
    Jog,
    Lease,
    LeaseLost,
    Move,
    MoveStatus,
    MoveStopped,
    MoveTimedOut,
    Refused,
    Unavailable,
    deg,
)
from axisync_client import client as client_module
from axisync_schemas.errors import ErrorCode, Refusal
from support.cell_peer import Peer

HERE = deg(*[0] * 6)
OPENED = {"lease", "events", "states", "setpoints", "updates", "jog"}
"""What is not awaited but entered or iterated."""


@pytest.mark.parametrize(
    ("blocking", "awaited"), [(Client, AsyncClient), (Lease, AsyncLease), (Move, AsyncMove), (Jog, AsyncJog)]
)
def test_the_names_and_arguments_are_the_same(blocking: type, awaited: type) -> None:
    def public(kind: type) -> dict[str, Any]:
        return {name: getattr(kind, name) for name in dir(kind) if not name.startswith("_")}

    methods = {name: method for name, method in public(blocking).items() if inspect.isfunction(method)}
    assert methods.keys() <= public(awaited).keys()
    for name, method in methods.items():
        theirs = public(awaited)[name]
        if name not in OPENED:
            given, known = (list(inspect.signature(one).parameters.values())[1:] for one in (theirs, method))
            assert given == known, name
        assert name in OPENED | {"check"} or inspect.iscoroutinefunction(theirs), name
        assert theirs.__doc__, name


def run(peer: Peer, work: Callable[[AsyncClient], Coroutine[Any, Any, None]]) -> None:
    """With a client, in a loop of its own, which must end by itself."""

    async def main() -> None:
        async with asyncio.timeout(30.0), AsyncClient(peer.endpoint) as client:
            await work(client)

    asyncio.run(main())


async def until(what: Callable[[], object]) -> None:
    end = time.monotonic() + 10.0
    while not what():
        assert time.monotonic() < end
        await asyncio.sleep(0.01)


async def seen(peer: Peer, message: Awaitable[Any], publish: Callable[[], None]) -> Any:
    """The first message; the subscription may take a moment to reach the router."""
    task = asyncio.ensure_future(message)
    end = time.monotonic() + 10.0
    while not task.done():
        assert time.monotonic() < end
        publish()
        await asyncio.wait([task], timeout=0.02)
    return task.result()


def test_a_jog_lasts_as_long_as_its_block(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        async with client.lease("kingkong") as arm:
            async with arm.jog(velocity=(0.1, 0, 0, 0, 0, 0)) as jog:
                await jog.sleep(0.3)
                jog.velocity = (0.05, 0, 0, 0, 0, 0)
                assert jog.reply is not None
                assert jog.blocked is None
                await jog.sleep(0.2)
            assert jog.velocity == (0.05, 0.0, 0.0, 0.0, 0.0, 0.0)

    run(peer, work)
    velocities = [body["velocity"] for verb, _, body in peer.requests if verb == "jog"]
    assert len(velocities) > 4
    assert velocities[0][0] == 0.1
    assert velocities[-2][0] == 0.05
    assert velocities[-1] == [0.0] * 6, "let go"


def test_a_move_from_enable_to_arrival(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        assert (client.cell, client.user, client.timeout_s) == ("eod", "anonymous", 5.0)
        assert client.endpoint == peer.endpoint
        async with client.lease("kingkong") as arm:
            assert (arm.groups, arm.epoch, arm.ttl_s, arm.lost) == (("kingkong",), 1, 2.0, False)
            await arm.enable()
            move = await arm.move_joint(HERE, duration_s=0.3)
            assert (move.group, move.reply.duration_s) == ("kingkong", 0.3)
            shares = [report.progress async for report in move.updates(0.02)]
            assert shares == sorted(shares)
            assert shares[-1] == 1.0
            assert (await move.result()).status is MoveStatus.SUCCEEDED
            assert await move.progress() == 1.0

    run(peer, work)
    assert not peer.leases


def test_plans_beside_each_other(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        plans = await asyncio.gather(*[client.plan_joint("kingkong", HERE, duration_s=s) for s in (1.0, 2.0, 3.0)])
        assert [plan.duration_s for plan in plans] == [1.0, 2.0, 3.0]

    run(peer, work)


def test_refusals_and_ends_of_moves_are_the_same_errors(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        async with client.lease("kingkong") as arm:
            with pytest.raises(Refused, match="enable it first") as caught:
                await arm.move_joint(HERE)
            assert caught.value.code is ErrorCode.NOT_ENABLED
            await arm.enable()
            move = await arm.move_joint(HERE, duration_s=30.0)
            with pytest.raises(MoveTimedOut):
                await move.wait(0.05)
            await move.stop()
            with pytest.raises(MoveStopped, match="a stop was asked for"):
                await move.result()

    run(peer, work)


def test_a_cancelled_wait_leaves_the_move_alone(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        async with client.lease("kingkong") as arm:
            await arm.enable()
            move = await arm.move_joint(HERE, duration_s=30.0)
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(move.result(), 0.1)
            assert (await move.report()).status is MoveStatus.EXECUTING

    run(peer, work)


def test_a_cancelled_acquisition_gives_the_lease_back(peer: Peer) -> None:
    peer.deaf["lease"] = 1

    async def work(client: AsyncClient) -> None:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(client.lease("kingkong"), 0.1)  # the repeated question will be answered
        await until(lambda: [body["action"] for verb, _, body in peer.requests if verb == "lease"][-1] == "release")

    run(peer, work)
    assert not peer.leases


def test_a_cancelled_task_gives_its_lease_back(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        async def hold() -> None:
            async with client.lease("kingkong"):
                await asyncio.sleep(30.0)

        task = asyncio.create_task(hold())
        await until(lambda: peer.leases)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert not peer.leases

    run(peer, work)


def test_a_lost_lease_is_told_in_the_loop_and_by_the_next_use(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        told: asyncio.Queue[tuple[AsyncLease, LeaseLost]] = asyncio.Queue()
        lease = await client.lease("kingkong", ttl_s=0.3, on_lost=lambda *what: told.put_nowait(what))
        peer.leases.clear()
        about, error = await asyncio.wait_for(told.get(), 10.0)
        assert about.groups == ("kingkong",)
        assert "is lost" in error.message
        assert lease.lost
        with pytest.raises(LeaseLost):
            await lease.enable()
        with pytest.raises(LeaseLost):
            lease.check()
        await lease.stop()
        with pytest.raises(LeaseLost):
            async with lease:
                pass

    run(peer, work)


def test_streams(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        async with client.states() as states:
            state = await seen(peer, anext(states), lambda: peer.publish("state", peer.state(7).model_dump_json()))
            assert state.seq == 7
        async with client.setpoints() as setpoints:
            payload = peer.batch(3, range(100, 110))
            batch = await seen(peer, anext(setpoints), lambda: peer.publish("setpoints", payload))
            assert batch.position[2].tolist() == (np.arange(12) + 102.0).tolist()

    run(peer, work)


def test_a_cancelled_wait_for_a_message_loses_none_and_gaps_are_counted(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        async with client.events() as events:
            first = peer.event(1, "first").model_dump_json()
            await seen(peer, anext(events), lambda: peer.publish("events", first))
            with suppress(TimeoutError):
                while True:  # also reads what was published more than once
                    await asyncio.wait_for(anext(events), 0.3)
            for seq in (2, 3, 6):
                peer.publish("events", peer.event(seq, "more").model_dump_json())
            assert [(await anext(events)).seq for _ in range(3)] == [2, 3, 6]
            assert events.missed == 2

    run(peer, work)


def test_a_closed_stream_ends_for_who_waits(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        events = client.events()
        reader = asyncio.create_task(anext(events, None))
        await asyncio.sleep(0.1)
        await events.close()
        assert await reader is None
        await events.close()
        assert [event async for event in events] == []

    run(peer, work)


def test_closing_the_client_ends_streams(peer: Peer) -> None:
    async def work(client: AsyncClient) -> None:
        async with client.events() as events:
            asyncio.get_running_loop().call_later(0.1, lambda: asyncio.ensure_future(client.close()))
            assert [event async for event in events] == []

    run(peer, work)


def test_silence_of_a_periodic_stream_is_an_error(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client_module, "STREAM_SILENCE_S", 0.2)

    async def work(client: AsyncClient) -> None:
        with pytest.raises(Unavailable, match="nothing came on axisync/eod/state"):
            await anext(client.states())

    run(peer, work)


def test_before_connecting_it_says_so_and_awaiting_connects(peer: Peer) -> None:
    async def main() -> None:
        client = AsyncClient(peer.endpoint)
        with pytest.raises(Unavailable, match="not connected"):
            await client.state()
        with pytest.raises(Unavailable, match="not connected"):
            _ = client.cell
        await client.close()
        assert (await client).cell == "eod"
        await client.close()
        with pytest.raises(Unavailable, match="closed"):
            await client.state()

    asyncio.run(main())


def test_errors_of_connecting_come_when_it_connects() -> None:
    async def main() -> None:
        with pytest.raises(Unavailable, match="nobody listens"):
            async with AsyncClient("127.0.0.1:1"):
                pass

    asyncio.run(main())


def test_a_refused_command_keeps_its_details(peer: Peer) -> None:
    peer.refusals["stop"] = Refusal(ErrorCode.INTERNAL, "no", allowed=5)

    async def work(client: AsyncClient) -> None:
        with pytest.raises(Refused) as caught:
            await client.stop()
        assert caught.value.details == {"allowed": 5}

    run(peer, work)
