"""Where a joint move ends."""

from collections.abc import Sequence

from axisync_schemas.commands import JointMove


def target_of(move: JointMove, start: Sequence[float]) -> tuple[float, ...]:
    """Absolute target, rad: for a relative move start + target, axis by axis."""
    if not move.relative:
        return move.target
    return tuple(a + b for a, b in zip(start, move.target, strict=True))
