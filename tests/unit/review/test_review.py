"""A review finds what is wrong, and nothing in a good log."""

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from axisync_review import chunks, pieces
from axisync_review.findings import gather
from axisync_review.limits import LOGGED
from axisync_review.models import Review
from axisync_review.review import review_of
from axisync_review.text import parts
from axisync_schemas.enumerations import GroupState
from axisync_schemas.ticks import Records
from support.command_line import Run
from support.recording import CELL
from support.saved_log import STOP_TICK, Maker, event

MIDDLE = 700


def review(*paths: Path) -> Review:
    return review_of(gather(paths, curves=True))


def test_a_good_log(good_log: Path) -> None:
    found = review(good_log)
    assert found.good, found.verdict
    assert found.problems == ()
    (move,) = found.moves
    assert (move.status, move.group, move.user, move.move_id) == ("succeeded", "kingkong", "ann", "m-1")
    assert move.played_s == pytest.approx((move.last_tick - move.first_tick + 1) * 0.002)  # type: ignore[operator]
    assert found.missing_ticks == 0
    assert found.duration_s == pytest.approx(found.ticks * 0.002)
    assert found.verdict == "good: limits kept (at most 100.0 % of one), no tick missing, moves: 1 succeeded"


def test_the_peaks_are_those_of_the_move(good_log: Path) -> None:
    """The move takes all that V, A and J give, and its shares show it; the other arm stands."""
    first, *_, last = review(good_log).axes
    assert first.velocity.share == pytest.approx(1.0, rel=1e-6)
    assert first.acceleration.share == pytest.approx(1.0, rel=1e-6)
    assert first.jerk.share == pytest.approx(1.0, rel=1e-5)
    assert (first.stop_jerk.peak, last.velocity.peak, last.jerk.peak) == (0.0, 0.0, 0.0)


def test_following_error_is_that_of_the_tick_before(good_log: Path) -> None:
    """The drives of these logs are one tick behind, so what they show at a tick is the setpoint of the SYNC before."""
    assert all(axis.following_error_peak == 0.0 for axis in review(good_log).axes)


def test_a_stop_keeps_its_own_limits(stopped_log: Path) -> None:
    found = review(stopped_log)
    assert found.good, found.verdict
    assert found.moves[0].status == "stopped"
    assert 0.3 < max(axis.stop_jerk.share for axis in found.axes) <= LOGGED
    assert [incident.kind for incident in found.incidents] == ["stop"]
    assert "1 stop" in found.verdict


def test_a_stop_at_the_limits_of_a_move_would_not_pass(make: Maker, stopped_log: Path) -> None:
    """The same ticks, but not said to be stopping: then they must keep what moves keep."""

    def moving(ticks: Records) -> None:
        ticks["group_state"][ticks["group_state"] == GroupState.STOPPING] = GroupState.MOVING

    kinds = {
        problem.message.split(":")[1].split(" is ")[0] for problem in review(make.write(STOP_TICK, moving)).problems
    }
    assert any("jerk by differences" in kind for kind in kinds)
    assert any("logged jerk" in kind for kind in kinds)


@pytest.mark.parametrize("name", ["velocity", "acceleration", "jerk"])
def test_a_limit_that_is_lower_is_exceeded(make: Maker, name: str) -> None:
    unit = {"velocity": "velocity_deg_s = 30", "acceleration": "acceleration_deg_s2 = 40", "jerk": "jerk_deg_s3 = 80"}
    key, value = unit[name].split(" = ")
    text = CELL.read_text().replace(unit[name], f"{key} = {float(value) * (1 - 1e-4)}")
    found = review(make.write(cell_text=text))
    assert not found.good
    assert {problem.kind for problem in found.problems} == {"limit"}
    assert any(f"{name} by differences" in problem.message for problem in found.problems)
    assert any(f"logged {name}" in problem.message for problem in found.problems)


@pytest.mark.parametrize("name", ["position", "velocity", "acceleration"])
def test_one_wrong_value_is_found_where_it_is(make: Maker, name: str) -> None:
    """A thousandth of a degree in one tick; the log contradicts itself, or breaks a limit."""

    def edit(ticks: Records) -> None:
        ticks[name][MIDDLE, 2] += {"position": 1e-6, "velocity": 1e-4, "acceleration": 2e-2}[name]

    found = review(make.write(edit=edit))
    assert not found.good
    assert {problem.axis for problem in found.problems} == {"kingkong.3"}
    assert min(abs(problem.tick - MIDDLE) for problem in found.problems if problem.tick) <= 3


def test_a_position_that_is_no_number(make: Maker) -> None:
    def edit(ticks: Records) -> None:
        ticks["position"][MIDDLE, 0] = np.nan

    found = review(make.write(edit=edit))
    assert "kingkong.1: position, which must be a number," in found.problems[0].message


def test_a_setpoint_that_moves_at_rest(make: Maker) -> None:
    def edit(ticks: Records) -> None:
        ticks["position"][5:, 8] += 1e-13

    assert "wukong.3: step of the setpoint at rest" in review(make.write(edit=edit)).problems[0].message


def test_a_move_that_misses_its_target(make: Maker) -> None:
    def edit(ticks: Records) -> None:
        end = np.flatnonzero(ticks["plan_id"][:, 0])[-1] + 1
        ticks["position"][end:, 1] = np.nextafter(ticks["position"][end, 1], 9.0)

    found = review(make.write(edit=edit))
    assert [problem.kind for problem in found.problems] == ["arrival"]
    assert "kingkong.2 ends at" in found.verdict


def test_missing_ticks(make: Maker) -> None:
    found = review(make.write(edit=lambda ticks: np.delete(ticks, [100, 101, 102, 500])))
    assert found.missing_ticks == 4
    assert [(gap.first_tick, gap.last_tick) for gap in found.gaps] == [(101, 103), (501, 501)]
    assert {problem.kind for problem in found.problems} == {"gap"}
    assert found.verdict.startswith("NOT GOOD: 3 ticks are missing, 101 to 103: the log does not say why")


@pytest.mark.parametrize("kept", [slice(None), slice(100, None)])
def test_ticks_that_a_starved_recorder_lost(make: Maker, run: Run, kept: slice) -> None:
    """Said by the recorder that came too late: also in a log that begins after them."""
    lost = event("recorder_lost", 330, lost=200, never_written=0, ranges=[[101, 300]], more=0) | {"source": "recorder"}
    log = make.write(edit=lambda ticks: np.delete(ticks, slice(100, 300))[kept], more=[("/events", 330, lost)])
    found = review(log)
    assert (found.missing_ticks, found.problems[0].kind, found.problems[0].tick) == (200, "gap", 101)
    assert found.verdict.startswith("NOT GOOD: 200 ticks are missing, 101 to 300: the recorder came later than the 10")
    assert "give it processor time, and a disk that keeps up" in found.verdict
    told = run("why", log).out
    assert "200 ticks are missing, 101 to 300: the recorder came later" in told
    assert "recorder   recorder_lost" in told


@pytest.mark.parametrize("ranges", [None, 5, [[1]], [["a", 2]], [[5, 1]], [[-4, -2]], [[2, 3], {}]])
def test_a_strange_report_of_lost_ticks(make: Maker, ranges: object) -> None:
    lost = event("recorder_lost", 30, lost="x", ranges=ranges)
    assert review(make.write(more=[("/events", 30, lost)])).good


@pytest.mark.parametrize(("skipped", "good"), [(5, True), (6, False)])
def test_skipped_ticks(make: Maker, skipped: int, good: bool) -> None:
    def edit(ticks: Records) -> None:
        ticks["skipped"][300 : 300 + skipped] = 1

    found = review(make.write(edit=edit))
    assert (found.lateness.skipped, found.lateness.skipped_in_a_row) == (skipped, skipped)
    assert found.good is good
    assert any(note.startswith(f"{skipped} ticks were skipped") for note in found.notes)


def test_skipped_ticks_while_nothing_is_enabled_are_no_fault(make: Maker) -> None:
    def edit(ticks: Records) -> Records:
        rest = ticks[:15]
        rest["group_state"], rest["skipped"][3:12] = GroupState.DISABLED, 1
        return rest

    found = review(make.write(edit=edit, story=False))
    assert found.good
    assert (found.lateness.skipped, found.verdict) == (9, "good: nothing moved, no tick is missing")


def test_an_instant_off_the_grid(make: Maker) -> None:
    def edit(ticks: Records) -> None:
        ticks["cycle_start_ns"][200:] += 1

    assert "off the grid" in review(make.write(edit=edit)).verdict


@pytest.mark.parametrize(("rows", "stop_tick"), [(1, 2), (2, 2), (3, 2), (90, STOP_TICK)])
def test_pieces_do_not_show(make: Maker, monkeypatch: pytest.MonkeyPatch, rows: int, stop_tick: int) -> None:
    """However the log is cut for reading, the report is the same, differences over the cuts included."""
    log, alike = make.write(stop_tick), chunks._alike
    whole = review(log)
    monkeypatch.setattr(pieces, "PIECE_ROWS", rows)
    monkeypatch.setattr(chunks, "_alike", lambda *run: min(rows, alike(*run)))
    assert review(log) == whole


def test_two_files_are_one_run(make: Maker, good_log: Path) -> None:
    """The second file begins with ticks that the first has too, as after a recorder's death."""
    first, second = make.write(span=slice(0, 800)), make.write(span=slice(780, None))
    found, whole = review(second, first), review(good_log)
    assert found.good, found.verdict
    assert (found.ticks, found.duplicate_ticks, found.sessions) == (whole.ticks, 20, 1)
    assert (found.axes, found.moves, found.events) == (whole.axes, whole.moves, whole.events)
    assert [file.path for file in found.files] == [str(first), str(second)]


def test_a_controller_that_was_started_again(make: Maker) -> None:
    def later(ticks: Records) -> Records:
        again: Records = ticks[:15].copy()
        again["cycle_start_ns"] += 3_600_000_000_007
        return again

    found = review(make.write(), make.write(edit=later, story=False))
    assert (found.sessions, found.missing_ticks, found.good) == (2, 0, True)
    assert "the controller was started 2 times" in found.notes


def test_a_log_cut_short_says_so(make: Maker) -> None:
    found = review(make.write(finish=False))
    assert found.good
    assert not found.files[0].complete
    assert "was not closed" in found.notes[0]


def test_the_command(run: Run, good_log: Path) -> None:
    shown = run("review", good_log)
    assert (shown.code, shown.err) == (0, "")
    for words in ("m-1", "succeeded", "kingkong.1", "100.0", "p99.9", "none missing", "kingkong 84%"):
        assert words in shown.out
    assert shown.out.splitlines()[-1].startswith("good: ")


def test_the_command_for_programs(run: Run, good_log: Path) -> None:
    printed = run("review", good_log, "--json")
    assert Review.model_validate_json(printed.out) == review(good_log)


def test_the_command_fails_where_something_is_wrong(run: Run, make: Maker) -> None:
    shown = run("review", make.write(edit=lambda ticks: np.delete(ticks, 100)))
    assert shown.code == 1
    assert "problem: 0.198 s: tick 101 is missing" in shown.out
    assert shown.out.splitlines()[-1].startswith("NOT GOOD: tick 101 is missing")


def test_moves_fit_into_a_narrow_terminal(good_log: Path) -> None:
    """With an id as long as the daemon's, and the longest words beside it."""
    found = review_of(gather([good_log]))
    (move,) = found.moves
    long = move.model_copy(update={"move_id": "m-1795399211347002", "kind": "sequence", "limiting": "kingkong.3"})
    console = Console(width=80, record=True, file=io.StringIO())
    for part in parts(found.model_copy(update={"moves": (long,)})):
        console.print(part)
    (line,) = (line for line in console.export_text().splitlines() if "sequence" in line)
    assert line.split()[1:3] == ["kingkong", "sequence"]
    assert line.split()[-2:] == ["kingkong.3", "succeeded"]
