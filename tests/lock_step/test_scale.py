"""One arm on one bus, eight buses: any cell is played by the same cycle."""

from pathlib import Path

import pytest

from axisync_schemas.enumerations import GroupState
from support.rate_runs import play_orders, problems
from support.scaled import scaled


@pytest.mark.parametrize(("buses", "axes", "group"), [(1, 1, "arm0"), (8, 1, "all_arms")])
def test_a_cell_of_any_size(tmp_path: Path, buses: int, axes: int, group: str) -> None:
    played = play_orders(tmp_path, scaled(buses, axes), [(80, "hold"), (420, "resume")], group, reach=0.2)
    assert problems(played) == []
    assert len(played.frames) == buses
    kinds = played.kinds()
    assert kinds.count("drive_ready") == buses * axes
    assert "move_resumed" in kinds
    last = played.log.ticks[played.moving[-1] + 1]
    assert last["position"][list(played.plan.axes)].tolist() == list(played.plan.end)
    assert (played.log.ticks["group_state"] == GroupState.HELD).any()


@pytest.mark.campaign
@pytest.mark.timeout(600)
@pytest.mark.parametrize(("buses", "axes"), [(1, 6), (4, 6), (8, 6)])
def test_whole_arms_on_many_buses(tmp_path: Path, buses: int, axes: int) -> None:
    group = "all_arms" if buses > 1 else "arm0"
    assert problems(play_orders(tmp_path, scaled(buses, axes), [(300, "stop")], group, reach=0.5)) == []
