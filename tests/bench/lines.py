"""Random straight moves of the tool, as the service plans them."""

from collections.abc import Iterator

import numpy as np

from axisync_motion import Trajectory
from axisync_schemas.errors import Refusal
from support.planner_jobs import PAPER, by, planned, trajectory_of

REACH = 0.2
"""m, in each direction."""


def tool_lines(count: int, seed: int = 8) -> Iterator[Trajectory]:
    """`count` of KingKong's from about the paper's place; those that are refused are left out."""
    rng = np.random.default_rng(seed)
    made = 0
    while made < count:
        start = tuple((np.array(PAPER) + rng.uniform(-0.3, 0.3, len(PAPER))).tolist())
        try:
            found = trajectory_of(planned(by(*rng.uniform(-REACH, REACH, 3).tolist()), start=start))
        except Refusal:
            continue
        made += 1
        yield found
