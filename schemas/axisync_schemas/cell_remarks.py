"""What of a cell's URDF files is not used as a reader of them might expect; for `axisyncd check`."""

import math
from collections.abc import Iterator

from axisync_schemas.cell import Cell, Group
from axisync_schemas.urdf import SOLID, Urdf


def remarks(cell: Cell) -> Iterator[str]:
    """Sentences. The cell file's limits hold, wider or not; meshes and what no axis moves have no shape."""
    for group in cell.groups:
        if group.urdf is not None:
            yield from _wider_limits(group, group.urdf)
            yield from _shapes_left_out(group, group.urdf)


def _wider_limits(group: Group, urdf: Urdf) -> Iterator[str]:
    joints = {joint.name: joint for joint in urdf.chain}
    for axis, name in zip(group.axes, group.joint_names, strict=True):
        theirs = joints[name].limits
        low, high = axis.hard_limits
        if theirs is not None and (low < theirs[0] - 1e-9 or high > theirs[1] + 1e-9):
            low, high, lower, upper = (math.degrees(x) for x in (low, high, *theirs))
            yield f"axis {axis.name}: hard_limits_deg {low:g} .. {high:g} hold; {urdf.file} has {lower:g} .. {upper:g}"


def _shapes_left_out(group: Group, urdf: Urdf) -> Iterator[str]:
    shaped = [axis.radius is not None or bool(axis.capsules) for axis in group.axes]
    given = {name for name, has in zip(group.joint_names, shaped, strict=True) if has}
    for link, shapes in urdf.tree.links.items():
        bearer = urdf.tree.bearer(link)
        if not shapes or (bearer is not None and bearer.name in given):
            continue
        if bearer is None or bearer.name not in group.joint_names:
            yield f"{urdf.file}: the shapes of link {link}, which no axis moves, are not used: give boxes for them"
        elif any(shape.kind not in SOLID for shape in shapes):
            yield f"{urdf.file}: the meshes of link {link} are not used: give radius_m or capsules of its axis"
