import time

import pytest

from axisync_cli.main import main
from axisync_client import Client
from axisync_schemas.enumerations import MoveStatus
from axisync_schemas.errors import ErrorCode, Refusal
from support.cell_peer import Peer, free_port
from support.command_line import Run

STEP = ("--joint", "-5,0,0,0,0,0deg", "--relative")
HELD_BY_ANN = "kingkong is held by ann: `axisync lease` shows the holders, --take takes over\n"
QUICK = (*STEP, "--duration", "0.3")


def test_state_for_people(run: Run) -> None:
    shown = run("state")
    assert shown.code == 0
    for word in ("kingkong", "wukong", "disabled", "-150.00", "6 operation enabled", "free", "late by 26"):
        assert word in shown.out
    assert "3 ticks skipped" in shown.out
    assert "31 degC" in shown.out
    assert "48.0 V" in shown.out
    for nothing_to_say in ("homed", "safe torque off"):
        assert nothing_to_say not in shown.out


def test_state_for_programs(run: Run) -> None:
    assert run("state", "--json").json["groups"]["kingkong"]["state"] == "disabled"


def test_enable_disable_and_reset(run: Run, peer: Peer) -> None:
    assert run("enable").out == "kingkong standstill, wukong standstill\n"
    assert run("disable", "wukong").out == "wukong disabled\n"
    assert run("reset", "kingkong", "--json").json["groups"] == {"kingkong": "disabled"}
    assert not peer.leases
    assert [verb for verb, _, _ in peer.requests][:3] == ["lease", "enable", "lease"]


def test_move_says_what_was_accepted_and_how_it_ended(run: Run, peer: Peer) -> None:
    run("enable", "kingkong")
    moved = run("move", "kingkong", *QUICK)
    assert moved.code == 0, moved.err
    assert moved.out == "move m-1: kingkong takes 0.300 s, limited by kingkong.1\nkingkong arrived\n"
    assert not peer.leases


def test_move_sends_what_was_typed(run: Run, peer: Peer) -> None:
    run("enable", "kingkong")
    options = ("--minimise", "jerk", "--pulse", "parabolic", "--speed", "50%", "--duration", "200ms")
    assert run("move", "kingkong", *STEP, *options).code == 0
    (body,) = [body for verb, _, body in peer.requests if verb == "move"]
    assert body["move"]["target"] == pytest.approx([-0.08726646, 0, 0, 0, 0, 0])
    assert (body["move"]["minimise"], body["move"]["pulse"], body["speed_scale"]) == ("jerk", "parabolic", 0.5)
    assert (body["move"]["relative"], body["move"]["duration_s"]) == (True, 0.2)


def test_move_prints_the_reply_for_programs(run: Run) -> None:
    run("enable", "kingkong")
    moved = run("move", "kingkong", *QUICK, "--json")
    assert (moved.code, moved.json["move_id"], moved.err) == (0, "m-1", "")


def test_a_disabled_group_is_one_sentence(run: Run, peer: Peer) -> None:
    moved = run("move", "kingkong", *STEP)
    assert (moved.code, moved.err) == (1, "kingkong is disabled: run `axisync enable kingkong`\n")
    assert moved.out == ""
    assert not peer.leases


def test_the_error_body_for_programs(run: Run) -> None:
    moved = run("move", "kingkong", *STEP, "--json")
    assert (moved.code, moved.json["code"], moved.err) == (1, "NOT_ENABLED", "")


@pytest.mark.parametrize("status", [MoveStatus.STOPPED, MoveStatus.FAILED, MoveStatus.HELD])
def test_a_move_that_does_not_arrive(run: Run, peer: Peer, status: MoveStatus, monkeypatch: pytest.MonkeyPatch) -> None:
    run("enable", "kingkong")
    report = peer.report
    monkeypatch.setattr(peer, "report", lambda move_id: _ended(peer, report, move_id, status))
    moved = run("move", "kingkong", *STEP, "--duration", "60")
    assert moved.code == 1
    assert moved.err.startswith("kingkong ")
    assert ": because" in moved.err
    assert ("axisync resume kingkong" in moved.err) is (status is MoveStatus.HELD)


def _ended(peer: Peer, report: object, move_id: str, status: MoveStatus) -> object:
    peer.end(peer.moves[move_id], status, "because")
    return report(move_id)  # type: ignore[operator]


def test_plan_for_people(run: Run, peer: Peer) -> None:
    shown = run("plan", "kingkong", "--joint", "-90,60,-45,0,0,0deg")
    assert shown.code == 0, shown.err
    for word in ("kingkong.6", "-150.00", "60.00", "limited by kingkong.2", "alone", "deg/s²", "kingkong.2 *"):
        assert word in shown.out
    assert max(map(len, shown.out.splitlines())) <= 80
    assert not peer.moves


def test_plan_shows_t_and_u_of_every_axis(run: Run) -> None:
    rows = run("plan", "kingkong", "--joint", "-90,60,-45,0,0,0deg").out.splitlines()
    cells = [[cell.strip() for cell in row.strip("│").split("│")] for row in rows if row.startswith("│")]
    (times,) = [row[2:] for row in cells if row[:2] == ["kingkong.2 *", "T"]]
    jerks = cells[[row[:2] for row in cells].index(["kingkong.2 *", "T"]) + 1]
    assert times == ["1.095", "0", "1.095", "0", "1.095", "0", "1.095"]
    assert jerks == ["", "U", "80.00", "0", "-80.00", "0", "-80.00", "0", "80.00"]


def test_plan_of_a_compound_relative_and_in_json(run: Run) -> None:
    joint = ",".join(["1"] * 12) + "deg"
    assert "wukong.6" in run("plan", "both", "--relative", "--joint", joint).out
    assert len(run("plan", "both", "--relative", "--joint", joint, "--json").json["T"]) == 12


def test_stop(run: Run, peer: Peer) -> None:
    assert run("stop").out == "kingkong disabled, wukong disabled\n"
    assert run("stop", "wukong", "--json").json["groups"] == {"wukong": "disabled"}
    assert [body["group"] for verb, _, body in peer.requests if verb == "stop"] == ["all", "wukong"]


def test_lease_shows_holders(run: Run, peer: Peer) -> None:
    with Client(peer.endpoint, user="ann") as client, client.lease("kingkong"):
        shown = run("lease")
        assert run("lease", "--json").json["lease"] == {"kingkong": "ann", "wukong": None}
        refused = run("enable")
    assert "ann" in shown.out
    assert "free" in shown.out
    assert (refused.code, refused.err) == (
        1,
        "kingkong is held by ann: `axisync lease` shows the holders, --take takes over\n",
    )


def test_a_lease_is_taken_over_by_any_command_that_needs_one(run: Run, peer: Peer) -> None:
    with Client(peer.endpoint, user="ann") as client:
        client.lease("kingkong", ttl_s=60.0)
        assert run("enable", "kingkong", "--take").code == 0
        client.lease("kingkong", ttl_s=60.0)
        assert run("move", "kingkong", *QUICK).code == 1
        assert run("move", "kingkong", *QUICK, "--take").code == 0
        client.lease("kingkong", ttl_s=60.0)
        assert run("jog", "kingkong", "--joint", "0,0,5deg,0,0,0", "--for", "100ms").code == 1
        assert run("jog", "kingkong", "--joint", "0,0,5deg,0,0,0", "--for", "100ms", "--take").code == 0
    assert run("lease", "--take").code == 2


def test_a_lease_lost_in_mid_move_is_one_sentence(run: Run, peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    run("enable", "kingkong")
    report = peer.report

    def taken(move_id: str) -> object:
        peer.leases.clear()
        return report(move_id)

    monkeypatch.setattr(peer, "report", taken)
    moved = run("move", "kingkong", *STEP, "--duration", "60")
    assert moved.code == 1
    assert moved.err.startswith(
        "the lease on kingkong is lost (this lease has lapsed, was released or taken over): `axisync lease`"
    )
    assert moved.err.endswith("`axisync stop kingkong` ends it\n")
    assert moved.err.count("\n") == 1


def test_the_newest_events(run: Run, peer: Peer) -> None:
    assert run("events").out == ""
    peer.events = [peer.event(seq, f"number {seq}") for seq in range(1, 31)]
    assert run("events").out.splitlines()[0] == "12:00:00 front kingkong move_accepted: number 11"
    assert [line.split()[-1] for line in run("events", "--last", "2").out.splitlines()] == ["29", "30"]
    assert run("events", "-n", "0").out == ""
    assert run("events", "-n", "1", "--json").json["seq"] == 30


def test_version(run: Run) -> None:
    shown = run("--version")
    assert (shown.code, shown.out.split()[0], shown.out.split()[-1]) == (0, "axisync", "1")


def test_another_version_of_the_daemon_is_one_sentence(run: Run, peer: Peer) -> None:
    peer.schema_versions = (7,)
    shown = run("state")
    assert (shown.code, shown.err.count("\n")) == (1, 1)
    assert shown.err.startswith("the daemon (axisync 9.9) serves schema 7, this client (axisync ")
    assert run("state", "--json").json["code"] == "UNSUPPORTED_SCHEMA"


def test_every_command_is_explained_in_one_line(run: Run) -> None:
    listed = run("--help").out.split("Commands:")[1].splitlines()
    assert [line for line in listed if line.endswith("...")] == []


def test_an_unknown_group_names_the_known(run: Run) -> None:
    enabled = run("enable", "kong")
    assert enabled.code == 1
    assert enabled.err == "group: no group 'kong' in this cell: the groups are kingkong, wukong, all\n"


def test_global_options_reach_the_daemon(run: Run, peer: Peer) -> None:
    assert run("stop", "--user", "ann", "--cell", "eod", "--timeout", "2").code == 0
    assert peer.requests[-1][1] == "ann"


def test_a_lease_may_be_longer_for_a_slow_connection(run: Run, peer: Peer) -> None:
    assert run("enable", "kingkong", "--lease-ttl", "7").code == 0
    assert next(body["ttl_s"] for verb, _, body in peer.requests if verb == "lease") == 7.0


def test_nobody_there(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["state", "--endpoint", f"127.0.0.1:{free_port()}"]) == 1
    error = capfd.readouterr().err
    assert error.startswith("nobody listens at tcp/127.0.0.1:")
    assert error.count("\n") == 1


def test_nobody_there_for_programs(run: Run) -> None:
    shown = run("state", "--json", "--endpoint", f"127.0.0.1:{free_port()}")
    assert (shown.code, shown.json["code"]) == (1, "UNAVAILABLE")


def test_no_answer_in_time(run: Run, peer: Peer) -> None:
    peer.deaf["stop"] = 99
    begin = time.monotonic()
    stopped = run("stop", "--timeout", "0.5")
    assert (stopped.code, stopped.out) == (1, "")
    assert "no answer from" in stopped.err
    assert time.monotonic() - begin < 10.0


@pytest.mark.parametrize(
    "words",
    [
        ("dance",),
        ("move",),
        ("move", "kingkong"),
        ("move", "kingkong", "--joint", "a,b"),
        ("move", "kingkong", "--joint", "90deg,0"),
        ("move", "kingkong", *STEP, "--speed", "200%"),
        ("move", "kingkong", *STEP, "--duration", "-1"),
        ("move", "kingkong", *STEP, "--minimise", "time"),
        ("enable", "king/kong"),
        ("state", "--user", "a/b"),
        ("state", "--endpoint", "nowhere"),
        ("state", "--timeout", "0"),
        ("enable", "kingkong", "--lease-ttl", "61"),
    ],
)
def test_usage_errors(run: Run, peer: Peer, words: tuple[str, ...]) -> None:
    result = run(*words)
    assert result.code == 2
    assert result.err
    assert "Traceback" not in result.err
    assert [verb for verb, _, _ in peer.requests if verb == "move"] == []


def test_a_fault_of_our_own_is_a_sentence_too(run: Run, peer: Peer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Client, "state", lambda self: 1 / 0)
    shown = run("state")
    assert (shown.code, shown.err.count("\n")) == (1, 1)
    assert "ZeroDivisionError" in shown.err
    monkeypatch.setenv("AXISYNC_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        run("state")


def test_refusals_name_numbers(run: Run, peer: Peer) -> None:
    peer.refusals["plan"] = Refusal(ErrorCode.INFEASIBLE_DURATION, "1 s is too short.", shortest_duration_s=5.25)
    shown = run("plan", "kingkong", *STEP)
    assert shown.err == "1 s is too short: the shortest possible duration is 5.25 s\n"


@pytest.mark.parametrize("words", [("--help",), ("move", "-h"), ()])
def test_help(run: Run, words: tuple[str, ...]) -> None:
    shown = run(*words)
    assert shown.code == (0 if words else 2)
    assert "Usage: axisync" in shown.out + shown.err


@pytest.mark.parametrize(("command", "usage"), [("enable", "[GROUP]"), ("drive", "{AXIS} {OBJECT} [VALUE]")])
def test_help_writes_optional_words_in_brackets(run: Run, command: str, usage: str) -> None:
    assert f"axisync {command} [OPTIONS] {usage}" in run(command, "--help").out.splitlines()[0]
