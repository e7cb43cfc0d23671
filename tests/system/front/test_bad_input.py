"""Whatever comes in: a typed error with the field's path; no motion, no restart, no growth."""

import json
import time
from pathlib import Path
from typing import Any

import psutil
import pytest

pytestmark = pytest.mark.unhurried

Client = Any
Service = Any
GROWTH_BYTES = 48 * 2**20
HUGE = b"x" * 5_000_000


def nested(depth: int) -> bytes:
    return b'{"group": "kingkong", "move": ' + b'{"a":' * depth + b"1" + b"}" * depth + b"}"


def move(**change: Any) -> bytes:
    return json.dumps({"group": "kingkong", "lease": "?", "move": {"target": [0.0] * 6} | change}).encode()


RAW: list[tuple[bytes, str, str | None]] = [
    (HUGE, "TOO_LARGE", None),
    (b"{" + HUGE, "TOO_LARGE", None),
    (b"x" * 65537, "TOO_LARGE", None),
    (b"x" * 65536, "INVALID_REQUEST", ""),
    (b"", "INVALID_REQUEST", ""),
    (b"\xff\xfe\xfd", "INVALID_REQUEST", ""),
    (b"\x00" * 64, "INVALID_REQUEST", ""),
    (b"not json", "INVALID_REQUEST", ""),
    (b"[]", "INVALID_REQUEST", ""),
    (b'{"group": "kingkong"', "INVALID_REQUEST", ""),
    (nested(30), "INVALID_REQUEST", "move.target"),
    (nested(10_000), "INVALID_REQUEST", ""),
    (move(target=[0.0] * 5 + [float("nan")]), "INVALID_REQUEST", "move.target[5]"),
    (move(target=[0.0] * 5 + [float("inf")]), "INVALID_REQUEST", "move.target[5]"),
    (move(target=[0.0] * 5 + ["0.1"]), "INVALID_REQUEST", "move.target[5]"),
    (move(target=[0.0] * 65), "INVALID_REQUEST", "move.target"),
    (move(target=None), "INVALID_REQUEST", "move.target"),
    (move(warp=9), "INVALID_REQUEST", "move.warp"),
    (move().replace(b'"?"', b'"?", "x": 1'), "INVALID_REQUEST", "x"),
    (move().replace(b'"group"', b'"schema": 7, "group"'), "UNSUPPORTED_SCHEMA", None),
    (b'{"schema": 1, "k": "' + b"y" * 60_000 + b'"}', "INVALID_REQUEST", "k"),
    (json.dumps({f"k{i}": i for i in range(4000)}).encode(), "INVALID_REQUEST", ""),
]


@pytest.mark.parametrize(("raw", "code", "path"), RAW, ids=[f"{i}-{row[1]}" for i, row in enumerate(RAW)])
def test_raw_bodies(service: Service, client: Client, refused: Any, raw: bytes, code: str, path: str | None) -> None:
    for verb in ("move", "plan"):
        body = refused(client.ask, f"cmd/anonymous/{verb}", raw)
        assert body["code"] == code
        if path is not None:
            assert path in [fault["path"] for fault in body["details"]["errors"]]
    assert service.peer.commands == []


@pytest.mark.parametrize("verb", ["jog", "hold", "resume", "override", "enable", "reset", "home", "drive", "lease"])
def test_every_verb_says_what_is_missing(service: Service, client: Client, refused: Any, verb: str) -> None:
    body = refused(client.ask, f"cmd/anonymous/{verb}", b"{}")
    assert body["code"] == "INVALID_REQUEST"
    missing = {fault["path"] for fault in body["details"]["errors"]}
    assert missing & {"group", "axis", "groups", "action"}
    assert service.peer.commands == []


@pytest.mark.parametrize("raw", [HUGE, b"\xff", b"[", b'{"group": "nobody"}', b'{"group": 1}', nested(5000)])
def test_bad_stops(client: Client, refused: Any, raw: bytes) -> None:
    assert refused(client.ask, "cmd/anonymous/stop", raw)["code"] in ("TOO_LARGE", "INVALID_REQUEST")


def test_the_right_number_of_axes(client: Client) -> None:
    lease = client.lease()
    for group, count in (("kingkong", 5), ("kingkong", 7), ("both", 6)):
        body = client.refused("move", group=group, lease=lease, move={"target": [0.0] * count})
        assert body["code"] == "INVALID_REQUEST"
        assert body["details"]["errors"][0]["path"] == "move.target"


def test_huge_numbers(client: Client) -> None:
    lease = client.lease()
    for value in (1e308, -1e308, 1e17):
        for relative in (True, False):
            body = client.refused(
                "move", group="kingkong", lease=lease, move={"target": [value] * 6, "relative": relative}
            )
            assert body["code"] == "SOFT_LIMIT"


@pytest.mark.parametrize("user", ["root", "anonymous2"])
def test_other_users(client: Client, refused: Any, user: str) -> None:
    for verb in ("move", "stop", "lease"):
        assert refused(client.ask, f"cmd/{user}/{verb}", b"{}")["code"] == "NOT_AUTHORISED"


def test_wildcards_on_commands(service: Service, client: Client) -> None:
    before = [service.control.group(i, 0) for i in (0, 1)]
    for key in (
        "axisync/eod/cmd/*/stop",
        "axisync/*/cmd/anonymous/stop",
        "axisync/eod/cmd/**",
        "axisync/eod/cmd/*/move",
    ):
        replies = list(client.session.get(key, payload=b"{}", timeout=5.0))
        assert replies
        assert all(reply.err is not None for reply in replies)
        codes = {json.loads(reply.err.payload.to_bytes())["code"] for reply in replies}
        assert codes == {"INVALID_REQUEST"}
    assert [service.control.group(i, 0) for i in (0, 1)] == before
    assert service.peer.commands == []


def test_a_body_beyond_all_measure_costs_its_sender_only(client: Client) -> None:
    assert [
        r for r in client.session.get("axisync/eod/cmd/anonymous/move", payload=HUGE * 6, timeout=1.0) if r.ok
    ] == []
    assert client.ask("info")["name"] == "eod"


def test_nothing_grows_and_nothing_restarts(service: Service, client: Client) -> None:
    front = psutil.Process(service.processes["front"].pid)
    pending = [0]

    def count(_: object) -> None:
        pending[0] -= 1

    def burst(times: int) -> None:
        for _ in range(times):
            for raw, _, _ in RAW:
                pending[0] += 1
                client.session.get("axisync/eod/cmd/anonymous/move", count, payload=raw, timeout=10.0)
            deadline = time.monotonic() + 20.0
            while pending[0] > 0 and time.monotonic() < deadline:
                time.sleep(0.01)

    burst(4)
    before = front.memory_info().rss
    burst(12)
    assert front.memory_info().rss - before < GROWTH_BYTES
    assert service.processes["front"].poll() is None
    assert "Traceback" not in service.errors("front")
    assert Path(f"/proc/{front.pid}").exists()


def test_a_flood_is_limited_and_stop_is_not(client: Client) -> None:
    codes: list[str] = []

    def note(reply: Any) -> None:
        codes.append("ok" if reply.ok else json.loads(reply.err.payload.to_bytes()).get("code", "?"))

    sent, end = 0, time.monotonic() + 10.0
    while "RATE_LIMITED" not in codes and time.monotonic() < end:
        client.session.get("axisync/eod/cmd/anonymous/plan", note, payload=b"{}", timeout=5.0)
        sent += 1
    for _ in range(20):
        client.command("stop")
    while len(codes) < sent and time.monotonic() < end + 10.0:
        time.sleep(0.01)
    time.sleep(1.1)  # The tests that follow are the same user.
    assert len(codes) == sent
    assert set(codes) <= {"INVALID_REQUEST", "RATE_LIMITED"}
    if "RATE_LIMITED" not in codes:
        pytest.skip("this machine cannot send 500 requests a second")
