"""plan, move and run of the tool's paths and of programs, from the words typed to the request that is sent."""

from pathlib import Path

import pytest

from axisync_schemas.errors import ErrorCode, Refusal
from support.cell_peer import Body, Peer
from support.command_line import Run

PROGRAM = """
schema = 1
name = "nod"
group = "kingkong"
speed_scale = 0.5
[[steps]]
kind = "joint"
target_deg = [0, 0, 0, 0, 0, 0]
duration_s = 0.1
[[steps]]
kind = "dwell"
duration_s = 0.1
"""


def sent(peer: Peer) -> Body:
    """The last plan or move that was asked for."""
    return [body for verb, _, body in peer.requests if verb in ("plan", "move")][-1]


@pytest.fixture
def program(tmp_path: Path) -> str:
    path = tmp_path / "nod.toml"
    path.write_text(PROGRAM)
    return str(path)


def test_a_line_is_sent_as_it_was_typed(run: Run, peer: Peer) -> None:
    options = ("--euler", "0,90,0deg", "--frame", "body", "--linear-limits", "150,200,300mm", "--no-retime")
    more = ("--angular-limits", "30,40,80deg", "--orientation", "euler_zyz", "--pulse", "parabolic", "--relative")
    shown = run("plan", "kingkong", "--linear", "-300,0,120mm", *options, *more, "--duration", "9", "--speed", "50%")
    assert (shown.code, shown.err) == (0, "")
    move = sent(peer)["move"]
    assert (move["kind"], move["frame"], move["retime"], move["relative"]) == ("linear", "body", False, True)
    assert move["target"]["position"] == pytest.approx([-0.3, 0.0, 0.12])
    assert move["target"]["euler_zyz"] == pytest.approx([0.0, 1.5707963, 0.0])
    assert move["linear_limits"] == pytest.approx([0.15, 0.2, 0.3])
    assert move["angular_limits"] == pytest.approx([0.5235988, 0.6981317, 1.3962634])
    assert (move["orientation"], move["pulse"], move["duration_s"]) == ("euler_zyz", "parabolic", 9.0)
    assert sent(peer)["speed_scale"] == 0.5


def test_what_is_not_typed_is_left_to_the_cell(run: Run, peer: Peer) -> None:
    run("plan", "kingkong", "--linear", "0.3,0,0.12")
    assert sent(peer)["move"] == {
        "kind": "linear", "target": {"position": [0.3, 0.0, 0.12]}, "frame": "base", "relative": False, "retime": True,
        "orientation": "rotation_vector", "minimise": "acceleration", "pulse": "constant", "contacts": [],
    }  # fmt: skip


def test_the_table_of_a_path(run: Run) -> None:
    shown = run("plan", "kingkong", "--linear", "300,0,120mm").out
    for words in (
        "length, mm", "300.00", "rotation, deg", "90.00", "mm/s³ and deg/s³", "limited by kingkong.5",
        "stretched 1.8 times, or kingkong.5 would exceed its limits",
        "kingkong link 3 and body come nearest, 84.3 mm apart",
        "28.6 deg to the hard limit of kingkong.2 and 40.1 mm between shapes", "ends with the joints at 0.00,-150.00",
    ):  # fmt: skip
        assert words in shown
    assert max(len(line) for line in shown.splitlines() if line[0] in "┏┃└│") <= 80


def test_two_arms_at_once(run: Run, peer: Peer) -> None:
    shown = run("plan", "both", "--linear", "kingkong=0,0,50mm", "--linear", "wukong=0,0,-50mm", "--relative")
    assert "wukong.length, mm" in shown.out
    target = sent(peer)["move"]["target"]
    assert {name: pose["position"] for name, pose in target.items()} == {
        "kingkong": [0.0, 0.0, 0.05],
        "wukong": [0.0, 0.0, -0.05],
    }


def test_an_arc(run: Run, peer: Peer) -> None:
    assert (
        run("plan", "kingkong", "--circular", "0,200,0mm", "--via", "100,100,0mm", "--quaternion", "0,0,0,1").code == 0
    )
    move = sent(peer)["move"]
    assert move["via"] == {"position": pytest.approx([0.1, 0.1, 0.0])}
    assert move["target"]["quaternion"] == [0.0, 0.0, 0.0, 1.0]


def test_a_line_is_moved(run: Run, peer: Peer) -> None:
    run("enable", "kingkong")
    moved = run("move", "kingkong", "--linear", "300,0,120mm", "--duration", "0.2")
    assert (
        moved.out == "move m-1: kingkong takes 0.200 s, limited by kingkong.5 (stretched 1.8 times)\nkingkong arrived\n"
    )


def test_a_program_is_planned_step_by_step(run: Run, peer: Peer, program: str) -> None:
    shown = run("plan", "--file", program, "--speed", "50%")
    assert shown.code == 0, shown.err
    for words in ("step", "joint", "dwell", "kingkong would take 0.200 s in 2 steps", "stretched 2 times at most"):
        assert words in shown.out
    assert (sent(peer)["group"], sent(peer)["speed_scale"]) == ("kingkong", 0.25)
    assert run("plan", "kingkong", "--file", program, "--json").json["steps"][1]["kind"] == "dwell"


def test_a_program_is_run(run: Run, peer: Peer, program: str) -> None:
    run("enable", "kingkong")
    done = run("run", program)
    assert (done.code, done.out) == (0, "move m-1: kingkong takes 0.200 s in 2 steps\nkingkong arrived\n")
    assert [step["kind"] for step in sent(peer)["move"]["steps"]] == ["joint", "dwell"]
    assert not peer.leases


def test_a_refused_program_names_the_step(run: Run, peer: Peer, program: str) -> None:
    peer.refusals["move"] = Refusal(
        ErrorCode.UNREACHABLE, "step 2 of 2 (linear): kingkong: the tool would be out of reach by 12 mm",
        nearest_reachable={"position": [0.3, 0.0, 0.1], "quaternion": [0.0, 0.0, 0.0, 1.0]}, step=1,
    )  # fmt: skip
    refused = run("run", program)
    assert (refused.code, refused.out) == (1, "")
    assert refused.err.startswith(
        "step 2 of 2 (linear): kingkong: the tool would be out of reach by 12 mm: the nearest"
    )
    assert "300.00,0.00,100.00mm" in refused.err
    assert run("run", program, "--json").json["details"]["step"] == 1


def test_a_wrong_program_names_its_steps(run: Run, peer: Peer, tmp_path: Path) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(PROGRAM.replace("target_deg", "target"))
    refused = run("run", str(path))
    assert refused.code == 2
    assert refused.err.startswith(f"{path}: step 1 of 2: target: has no unit: write target_deg")
    assert not peer.requests


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "where to is missing: give one of --joint, --linear, --circular, --file"),
        (("kingkong",), "where to is missing"),
        (("--linear", "1,2,3m"), "GROUP is missing"),
        (("wukong", "--file", "{program}"), "is for kingkong, not for wukong"),
        (("--file", "no.toml"), "no.toml: cannot be read: No such file"),
        (("--file", "{program}", "--relative"), "--relative does not go with --file"),
        (("kingkong", "--joint", "1", "--linear", "1,2,3"), "--joint and --linear are two moves"),
        (("kingkong", "--joint", "1", "--no-retime"), "--no-retime does not go with --joint: it goes with --linear"),
        (("kingkong", "--joint", "1", "--linear-limits", "1,1,1"), "--linear-limits does not go with --joint"),
        (
            ("kingkong", "--linear", "1,2,3", "--via", "1,2,3"),
            "--via does not go with --linear: it goes with --circular",
        ),
        (("kingkong", "--circular", "1,2,3"), "--via is missing"),
        (("kingkong", "--linear", "1,2"), "must be 3 values"),
        (("kingkong", "--linear", "1,2,3", "--quaternion", "0,0,0,3"), "quaternion has length 3"),
        (("kingkong", "--linear", "1,2,3", "--linear", "1,2,3"), "several --linear for one group"),
        (("both", "--linear", "a=1,2,3", "--linear", "a=1,2,3"), "several --linear for one group"),
        (("both", "--linear", "a=1,2,3", "--linear", "b=1,2,3", "--euler", "0,0,0"), "one orientation for several"),
        (("king/kong", "--linear", "1,2,3"), "group: "),
    ],
)
def test_words_that_do_not_go_together(run: Run, peer: Peer, program: str, words: tuple[str, ...], said: str) -> None:
    for command in ("plan", "move"):
        refused = run(command, *(word.format(program=program) for word in words))
        assert (refused.code, refused.out) == (2, "")
        assert said in refused.err
    assert not peer.requests


def test_help_shows_how_to_write_it(run: Run) -> None:
    shown = run("plan", "--help").out
    for words in ("--linear X,Y,Z", "300,0,120mm", "--file FILE", "Examples:", "axisync plan kingkong --linear"):
        assert words in shown
    assert "FILE" in run("run", "--help").out
