"""`axisync home` and `axisync drive` against a peer: what is sent, what is printed."""

import time
from collections.abc import Callable

import pytest
import typer

from axisync_cli import drive_commands
from axisync_cli.drive_commands import in_words, parsed
from axisync_cli.main import app
from axisync_schemas.errors import ErrorCode, Refusal
from axisync_schemas.replies import DriveReply, GroupReply
from support.cell_peer import Body, Peer
from support.command_line import Run


def names(application: typer.Typer) -> set[str | None]:
    return {command.name for command in application.registered_commands}


if "drive" not in names(app):
    drive_commands.add_to(app)


@pytest.fixture
def drives(peer: Peer, monkeypatch: pytest.MonkeyPatch) -> Peer:
    """The peer, with drives that have one object."""
    answer = peer._answer

    def more(query, parts, verb):  # type: ignore[no-untyped-def]
        handlers: dict[str, Callable[[Body], object]] = {
            "home": lambda body: GroupReply(**peer._stamp(body), groups={body["group"]: "standstill"}),
            "drive": lambda body: DriveReply(
                **peer._stamp(body), axis=body["axis"], object="0x6079:0", name="DC link circuit voltage",
                value=body.get("value", 48000), data="80bb0000",
            ),
        }  # fmt: skip
        if verb in handlers and verb not in peer.refusals:
            return handlers[verb](peer._note(query, verb))
        return answer(query, parts, verb)

    monkeypatch.setattr(peer, "_answer", more)
    return peer


def test_home(run: Run, drives: Peer) -> None:
    done = run("home", "kingkong")
    assert (done.code, done.out) == (0, "kingkong standstill\n"), done.err
    assert [verb for verb, _, _ in drives.requests] == ["lease", "home", "lease"]
    assert run("home", "wukong", "--json").json["groups"] == {"wukong": "standstill"}


def test_why_home_was_not_found(run: Run, drives: Peer) -> None:
    drives.refusals["home"] = Refusal(ErrorCode.WRONG_STATE, "kingkong was not homed: kingkong.1: home was not found")
    done = run("home", "kingkong")
    assert done.code == 1
    assert "kingkong.1: home was not found" in done.err


def test_reading_needs_no_lease(run: Run, drives: Peer) -> None:
    done = run("drive", "kingkong.1", "0x6079")
    assert done.out == "kingkong.1 0x6079:0 (DC link circuit voltage) = 48000 (0x0000BB80)\n", done.err
    assert [verb for verb, _, _ in drives.requests] == ["drive"]
    assert run("drive", "kingkong.1", "DC link circuit voltage", "--json").json["value"] == 48000


@pytest.mark.parametrize(("text", "value"), [("-5", -5), ("0x10", 16), ("0.5", 0.5), ("save", "save")])
def test_writing_takes_the_lease_of_the_axis(run: Run, drives: Peer, text: str, value: object) -> None:
    done = run("drive", "wukong.3", "0x6079", text)
    assert done.code == 0, done.err
    verbs = [(verb, body.get("groups"), body.get("value")) for verb, _, body in drives.requests]
    assert verbs[0][:2] == ("lease", ["wukong"])
    assert verbs[1] == ("drive", None, value)


def test_an_unknown_axis(run: Run, drives: Peer) -> None:
    done = run("drive", "nobody", "0x6079", "1")
    assert done.code == 2
    assert "no axis 'nobody' in eod" in done.err


def test_bytes_and_negative_numbers_in_words() -> None:
    common = {"request_id": "r", "now_s": time.monotonic(), "axis": "a", "object": "0x6077:0", "name": None}
    assert in_words(DriveReply(**common, value=-2, data="feff")) == "a 0x6077:0 = -2 (0xFFFE)"  # type: ignore[arg-type]
    assert in_words(DriveReply(**common, value=None, data="0102")) == "a 0x6077:0 = 0102 (bytes)"  # type: ignore[arg-type]
    assert parsed("0b11") == 3
