"""The closed form against another analytic solver: the same set of solutions for thousands of poses."""

import math

import numpy as np
import pytest
import ssik

from support.arms import cell, rows_of, solver


@pytest.mark.parametrize("index", [0, 1])
def test_the_same_solutions(index: int) -> None:
    group = cell().groups[index]
    rows, inverse = rows_of(group), solver(group)
    other = ssik.Manipulator.from_dh([r.alpha for r in rows], [r.a for r in rows], [r.d for r in rows])
    q = np.random.default_rng(7 + index).uniform(-math.pi, math.pi, (1000, 6))
    poses = inverse.forward(q)
    found = inverse.solve(poses, np.zeros(6))
    in_base = np.linalg.inv(inverse.base) @ poses
    for target, angles, reachable in zip(in_base, found.angles, found.reachable, strict=True):
        ours = angles[reachable]
        theirs = np.array([solution.q for solution in other.solve(target, respect_limits=False)])
        off = np.abs(np.remainder(theirs[:, None] - ours[None] + math.pi, math.tau) - math.pi).max(axis=-1)
        assert off.min(axis=1).max() < 1e-6
        assert off.min(axis=0).max() < 1e-6
