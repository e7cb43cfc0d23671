"""What a client meets: queries, publications, commands from request to end, refusals."""

import json
import threading
import time
from typing import Any
from uuid import uuid4

import pytest
import zenoh

from axisync_schemas.enumerations import Phase
from axisync_schemas.errors import ErrorBody, ErrorCode
from axisync_schemas.export import MODELS, schema
from axisync_schemas.internal import BeginCommand
from axisync_schemas.memory import GroupWord, Word

pytestmark = pytest.mark.unhurried

Client = Any
Service = Any
STEP = [0.05] * 6


def begins(service: Service) -> list[BeginCommand]:
    return [command for command in service.peer.commands if isinstance(command, BeginCommand)]


def wait(found: Any, timeout_s: float = 10.0) -> Any:
    deadline = time.monotonic() + timeout_s
    while not (answer := found()):
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.005)
    return answer


def test_queries(service: Service, client: Client) -> None:
    info = client.ask("info")
    assert (info["name"], info["schema_versions"]) == ("eod", [1])
    verbs = "disable drive enable hold home jog lease move override plan reset resume stop"
    assert info["verbs"] == verbs.split()
    assert abs(info["now_s"] - time.monotonic()) < 5.0
    assert client.ask("config") == json.loads(service.cell.model_dump_json(by_alias=True))
    assert client.ask("schema/MoveRequest") == schema(next(m for m in MODELS if m.__name__ == "MoveRequest"))
    state = client.ask("state")
    assert state["controller"] == "up"
    assert len(state["groups"]["kingkong"]["drives"]) == 6
    assert len(state["groups"]["wukong"]["pose"]["quaternion"]) == 4
    assert state["lease"] == {"kingkong": None, "wukong": None}


@pytest.mark.parametrize("key", ["moves/m-1", "moves/*", "schema/Nothing"])
def test_queries_for_what_is_not_there(client: Client, refused: Any, key: str) -> None:
    assert refused(client.ask, key)["code"] == "NOT_FOUND"


def test_a_move_from_request_to_end(service: Service, client: Client) -> None:
    client.subscribe()
    lease = client.lease()
    service.peer.pace = 0.05
    reply = client.move("kingkong", lease, STEP)
    assert client.report(reply["move_id"])["status"] == "executing"
    assert client.ask("state")["groups"]["kingkong"]["move_id"] == reply["move_id"]
    assert client.refused("move", group="both", lease=lease, move={"target": [0.0] * 12})["code"] == "BUSY"
    wait(lambda: client.report(reply["move_id"])["status"] == "succeeded")
    again = client.move("kingkong", lease, [-0.05] * 6)
    assert again["move_id"] != reply["move_id"]
    wait(lambda: client.report(again["move_id"])["status"] == "succeeded")
    wait(lambda: sum(event["kind"] == "move_ended" for event in client.events) == 2)
    numbers = [event["seq"] for event in client.events]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    plans = [entry for entry in service.entries() if entry["topic"] == "/plans"]
    assert [entry["data"]["move_id"] for entry in plans] == [reply["move_id"], again["move_id"]]
    assert [entry["slot"] for entry in plans] == [command.slot for command in begins(service)]


def test_the_next_move_may_follow_the_end_of_the_last_at_once(service: Service, client: Client) -> None:
    lease = client.lease()
    service.peer.pace = 10.0
    for i in range(20):
        reply = client.move("kingkong", lease, [0.01 if i % 2 else -0.01] * 6)
        wait(lambda move_id=reply["move_id"]: client.report(move_id)["status"] == "succeeded")


def test_both_arms_side_by_side_and_as_one(service: Service, client: Client) -> None:
    lease = client.lease()
    service.peer.pace = 0.02
    moves = [client.move(group, lease, STEP)["move_id"] for group in ("kingkong", "wukong")]
    wait(lambda: all(client.report(move_id)["status"] == "succeeded" for move_id in moves))
    reply = client.move("both", lease, [-0.05] * 12)
    assert len(reply["T"]) == 12
    state = client.ask("state")["groups"]
    assert state["kingkong"]["move_id"] == state["wukong"]["move_id"] == reply["move_id"]
    wait(lambda: client.report(reply["move_id"])["status"] == "succeeded")


def test_the_same_request_at_once_and_later_is_one_motion(service: Service, client: Client) -> None:
    body = {"request_id": str(uuid4()), "group": "kingkong", "lease": client.lease()}
    body |= {"move": {"target": [0.02] * 6, "relative": True}}
    answers: list[Any] = []
    senders = [threading.Thread(target=lambda: answers.append(client.command("move", **body))) for _ in range(4)]
    for sender in senders:
        sender.start()
    for sender in senders:
        sender.join()
    wait(lambda: client.report(answers[0]["move_id"])["status"] == "succeeded")
    answers.append(client.command("move", **body))
    assert all(answer == answers[0] for answer in answers)
    assert len(begins(service)) == 1
    assert client.refused("move", **body | {"speed_scale": 0.5})["code"] == "INVALID_REQUEST"


def test_plan_says_what_would_be(service: Service, client: Client) -> None:
    reply = client.command("plan", group="kingkong", move={"target": STEP, "relative": True})
    assert reply["move_id"] is None
    assert reply["limiting"].startswith("kingkong.")
    assert begins(service) == []


def test_stop_ends_a_move_and_needs_no_lease(service: Service, client: Client) -> None:
    lease = client.lease()
    service.peer.pace = 0.001
    move_id = client.move("both", lease, [0.1] * 12)["move_id"]
    before = service.control.group(1, GroupWord.STOP_COUNT)
    reply = client.command("stop", group="wukong")
    assert set(reply["groups"]) == {"wukong"}
    assert service.control.group(1, GroupWord.STOP_COUNT) == before + 1
    report = wait(lambda: (r := client.report(move_id))["status"] == "stopped" and r)
    assert report["reason"] == "stop"
    assert 0.0 <= report["progress"] < 1.0
    wait(lambda: any(entry["data"].get("verb") == "stop" for entry in service.entries()))


def test_a_lapsed_lease_holds_the_move_and_stop_ends_it(service: Service, client: Client) -> None:
    client.subscribe()
    lease = client.lease("kingkong", ttl_s=0.3)
    service.peer.pace = 0.0001
    move_id = client.move("kingkong", lease, STEP)["move_id"]
    wait(lambda: client.report(move_id)["status"] == "held")
    assert client.ask("state")["lease"]["kingkong"] is None
    assert client.refused("move", group="kingkong", lease=lease, move={"target": STEP})["code"] == "LEASE_FENCED"
    new = client.lease("kingkong")
    assert client.refused("move", group="kingkong", lease=new, move={"target": STEP})["code"] == "WRONG_STATE"
    time.sleep(0.1)
    assert client.report(move_id)["status"] == "held", "nothing resumes by itself"
    client.command("stop", group="kingkong")
    wait(lambda: client.report(move_id)["status"] == "stopped")
    assert "lease_lapsed" in [event["kind"] for event in client.events]


def test_leases_over_the_network(client: Client) -> None:
    first = client.command("lease", action="acquire", groups=["both"], ttl_s=30.0)
    held = client.refused("lease", action="acquire", groups=["wukong"])
    assert (held["code"], held["details"]["holder"]) == ("LEASE_HELD", "anonymous")
    second = client.command("lease", action="take", groups=["both"], ttl_s=30.0)
    assert second["epoch"] > first["epoch"]
    late = client.refused("lease", action="renew", groups=["both"], lease=first["lease"])
    assert late["code"] == "LEASE_FENCED"
    client.command("lease", action="renew", groups=["both"], lease=second["lease"], ttl_s=30.0)
    client.command("lease", action="release", groups=["both"], lease=second["lease"])


def test_refusals_carry_numbers(client: Client) -> None:
    lease = client.lease()
    far = client.refused("move", group="kingkong", lease=lease, move={"target": [3.0] * 6})
    assert (far["code"], far["details"]["axis"], far["details"]["value"]) == ("SOFT_LIMIT", "kingkong.1", 3.0)
    hasty = client.refused(
        "move", group="kingkong", lease=lease, move={"target": STEP, "relative": True, "duration_s": 0.01}
    )
    assert hasty["code"] == "INFEASIBLE_DURATION"
    assert hasty["details"]["shortest_duration_s"] > 0.01
    stale = client.refused("enable", group="all", lease=lease, not_after_s=1.0)
    assert stale["code"] == "STALE"


def test_a_move_to_where_the_arm_is(service: Service, client: Client) -> None:
    reply = client.move("kingkong", client.lease(), [0.0] * 6)
    assert (reply["duration_s"], reply["limiting"]) == (0.0, None)
    assert client.report(reply["move_id"])["status"] == "succeeded"
    assert begins(service) == []


def test_what_the_controller_refuses_is_passed_on(service: Service, client: Client) -> None:
    lease = client.lease()
    service.peer.refuse = ErrorBody(code=ErrorCode.FAULTED, message="axis 3", details={"axis": "kingkong.3"})
    found = client.refused("enable", group="all", lease=lease)
    assert (found["code"], found["details"]) == ("FAULTED", {"axis": "kingkong.3"})
    assert client.refused("move", group="kingkong", lease=lease, move={"target": STEP})["code"] == "FAULTED"


def test_without_a_cycle(service: Service, client: Client) -> None:
    lease = client.lease()
    service.peer.silent = True
    wait(lambda: client.ask("state")["controller"] == "down")
    for verb, fields in (("enable", {}), ("move", {"move": {"target": STEP}})):
        assert client.refused(verb, group="kingkong", lease=lease, **fields)["code"] == "UNAVAILABLE"
    assert client.refused("stop")["code"] == "UNAVAILABLE"
    assert {g["state"] for g in client.ask("state")["groups"].values()} == {"disabled"}
    service.peer.silent = False
    wait(lambda: client.ask("state")["controller"] == "up")


def test_a_stopping_service_refuses_moves_but_stops(service: Service, client: Client) -> None:
    lease = client.lease()
    service.control[Word.PHASE] = Phase.STOPPING
    try:
        assert client.refused("move", group="kingkong", lease=lease, move={"target": STEP})["code"] == "UNAVAILABLE"
        assert client.refused("enable", group="all", lease=lease)["code"] == "UNAVAILABLE"
        client.command("stop")
    finally:
        service.control[Word.PHASE] = Phase.RUNNING


def test_publications_are_numbered_and_whole(service: Service, client: Client) -> None:
    samples: dict[str, list[bytes]] = {name: [] for name in ("state", "setpoints", "cycle")}
    for name, into in samples.items():
        client.session.declare_subscriber(
            f"axisync/eod/{name}", lambda sample, into=into: into.append(sample.payload.to_bytes())
        )
    wait(lambda: len(samples["cycle"]) >= 2 and len(samples["state"]) >= 10)
    for name in ("state", "cycle"):
        numbers = [json.loads(sample)["seq"] for sample in samples[name]]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    batches = [service.peer.layout.unbatch(sample) for sample in samples["setpoints"]]
    numbers = [seq for _, seq in batches]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    ticks = [tick for records, _ in batches for tick in records["tick"].tolist()]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    cycle = json.loads(samples["cycle"][-1])
    assert cycle["lateness_us"] == {"p50": 20.0, "p99": 20.0, "max": 20.0}


def test_nobody_else_can_serve_or_publish(service: Service, client: Client) -> None:
    other = service.client()
    try:
        heard: list[bytes] = []
        client.session.declare_subscriber("axisync/eod/state", lambda sample: heard.append(sample.payload.to_bytes()))
        client.session.declare_subscriber("axisync/eod/rumours", lambda sample: heard.append(sample.payload.to_bytes()))

        def fake(query: Any) -> None:
            with query:
                query.reply(str(query.key_expr), b'"fake"')

        kept = [other.session.declare_queryable(key, fake) for key in ("**", "axisync/eod/info", "axisync/eod/cmd/**")]
        time.sleep(0.2)
        for key in ("info", "cmd/anonymous/fly", "rumours"):
            replies = list(client.session.get(f"axisync/eod/{key}", target=zenoh.QueryTarget.ALL, timeout=2.0))
            assert len(replies) == (1 if key == "info" else 0)
        for key in ("state", "rumours"):
            other.session.put(f"axisync/eod/{key}", b"fake")
        time.sleep(0.3)
        wait(lambda: len(heard) > 10)
        assert b"fake" not in heard
        assert len(kept) == 3
    finally:
        other.session.close()
