"""The cell file: one robot, its groups, axes, drives and buses. Keys carry units; attributes are SI (rad, m, s)."""

import json
import math
import tomllib
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from axisync_schemas.base import Name, Strict
from axisync_schemas.cell_drive import DriveUnits, Homing, Monitor
from axisync_schemas.cell_recorder import Recording
from axisync_schemas.cell_text import FileMissing, with_defaults, with_files, with_texts
from axisync_schemas.cell_units import Degrees, Kilobits, Milliseconds, Percent, Positive, PositiveDegrees
from axisync_schemas.urdf import Urdf

STOP_ACCELERATION_RATIO = 1.2
STOP_JERK_RATIO = 2.0
"""stop_limits must leave this much more than limits (design decision 9): else a move in its last phase cannot slow."""


class CellError(ValueError):
    """The cell file is refused; the message has one line for each fault, with line or path."""


class Bus(Strict):
    """A CAN bus and the back end that reaches it."""

    name: Name
    interface: Literal["socketcan", "simcan"]
    channel: str = Field(min_length=1, max_length=107)
    bitrate: Kilobits = Field(alias="bitrate_kbit_s", default=1000.0)


class Limits(Strict):
    """What moves, override and resume keep: rad/s, rad/s^2, rad/s^3."""

    velocity: PositiveDegrees = Field(alias="velocity_deg_s")
    acceleration: PositiveDegrees = Field(alias="acceleration_deg_s2")
    jerk: PositiveDegrees = Field(alias="jerk_deg_s3")


class StopLimits(Strict):
    """What stop, hold and lapse keep: rad/s^2, rad/s^3."""

    acceleration: PositiveDegrees = Field(alias="acceleration_deg_s2")
    jerk: PositiveDegrees = Field(alias="jerk_deg_s3")


class Identity(Strict):
    """Identity object 0x1018 that the drive must show (CiA 301, 7.5.2.20)."""

    vendor_id: int = Field(ge=0, le=0xFFFFFFFF)
    product_code: int = Field(ge=0, le=0xFFFFFFFF)
    serial_number: int | None = Field(ge=0, le=0xFFFFFFFF, default=None)
    """Where the file names it, only this very drive is accepted."""


class Drive(Strict):
    """A CiA 402 device and how its counts map to the axis.

    counts = direction * (position - offset) * counts_per_turn * gear_ratio / (2 pi)
    """

    bus: Name
    node_id: int = Field(ge=1, le=126)
    counts_per_turn: int = Field(ge=1, le=2**31 - 1)
    gear_ratio: Positive = 1.0
    direction: Literal[1, -1] = 1
    offset: Degrees = Field(alias="offset_deg", default=0.0)
    on_missed: Literal["extrapolate", "hold"] = "extrapolate"
    following_error_max: PositiveDegrees = Field(alias="following_error_max_deg")
    quick_stop_deceleration: PositiveDegrees = Field(alias="quick_stop_deceleration_deg_s2")
    brake_release: Milliseconds = Field(alias="brake_release_ms")
    identity: Identity
    encoder: Literal["absolute", "incremental"] = "absolute"
    torque_max: Percent | None = Field(alias="torque_max_percent", default=None)
    """Of the rated torque (0x6072); None leaves the drive's own."""
    units: DriveUnits = DriveUnits()
    homing: Homing | None = None
    monitor: Monitor = Monitor()
    start: Degrees = Field(alias="emulator_start_deg", default=0.0)

    @model_validator(mode="after")
    def _knows_where_it_is(self) -> Self:
        if self.encoder == "incremental" and self.homing is None:
            raise ValueError("an incremental encoder forgets where it is: drive.homing must say how to find out")
        return self

    @cached_property
    def counts_per_rad(self) -> float:
        """Signed: includes gear and direction."""
        return self.direction * self.counts_per_turn * self.gear_ratio / (2.0 * math.pi)


class DenavitHartenberg(Strict):
    """Standard DH row: rotation theta about z, d along z, a along x, alpha about x."""

    d: float = Field(alias="d_m")
    a: float = Field(alias="a_m")
    alpha: Degrees = Field(alias="alpha_deg")
    theta: Degrees = Field(alias="theta_offset_deg", default=0.0)


class Capsule(Strict):
    """What is within `radius` of a segment (m), in the frame that turns with the axis.

    With a DH row: z along the axis, before d and a. Of a URDF joint: the frame of its child link.
    """

    start: tuple[float, float, float] = Field(alias="from_m")
    end: tuple[float, float, float] = Field(alias="to_m")
    radius: Positive = Field(alias="radius_m")


class Axis(Strict):
    """A logical coordinate with limits, moved by one drive.

    `joint` is its name in the group's URDF file, where that differs. `radius` wraps the link's DH offsets in capsules
    (of a URDF joint: the way to the next joint); `capsules` replaces these; with neither, the link has no shape but
    what the URDF file gives it.
    """

    name: Name
    dh: DenavitHartenberg | None = None
    joint: str | None = Field(min_length=1, default=None)
    radius: Positive | None = Field(alias="radius_m", default=None)
    capsules: tuple[Capsule, ...] = Field(max_length=8, default=())
    soft_limits: tuple[Degrees, Degrees] = Field(alias="soft_limits_deg")
    hard_limits: tuple[Degrees, Degrees] = Field(alias="hard_limits_deg")
    limits: Limits
    stop_limits: StopLimits
    drive: Drive

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        low, high = self.hard_limits
        soft_low, soft_high = self.soft_limits
        if not low <= soft_low < soft_high <= high:
            raise ValueError("soft_limits_deg must be an interval inside hard_limits_deg")
        for name, ratio in (("acceleration", STOP_ACCELERATION_RATIO), ("jerk", STOP_JERK_RATIO)):
            need = ratio * getattr(self.limits, name)
            have = getattr(self.stop_limits, name)
            if have < need * (1 - 1e-12):
                raise ValueError(
                    f"stop_limits {name} is {math.degrees(have):g}, must be at least {ratio:g} times that of limits "
                    f"= {math.degrees(need):g}"
                )
        if not low <= self.drive.start <= high:
            raise ValueError("drive.emulator_start_deg is outside hard_limits_deg")
        return self


class Pose(Strict):
    """Position (m) and fixed-axis roll, pitch, yaw (rad): R = Rz(yaw) Ry(pitch) Rx(roll)."""

    position: tuple[float, float, float] = Field(alias="position_m", default=(0.0, 0.0, 0.0))
    rpy: tuple[Degrees, Degrees, Degrees] = Field(alias="rpy_deg", default=(0.0, 0.0, 0.0))


class LinearLimits(Strict):
    """Along the tool's path: m/s, m/s^2, m/s^3."""

    velocity: Positive = Field(alias="velocity_m_s")
    acceleration: Positive = Field(alias="acceleration_m_s2")
    jerk: Positive = Field(alias="jerk_m_s3")


class PathSettings(Strict):
    """How the tool of a group moves along paths where the request does not say.

    `scale_max`: a path that would have to be stretched by more than this for its joints' limits is refused: it passes
    too near a singularity.
    """

    linear_limits: LinearLimits = LinearLimits(velocity=0.25, acceleration=0.5, jerk=2.5)
    angular_limits: Limits = Limits(velocity=30.0, acceleration=60.0, jerk=300.0)
    scale_max: float = Field(ge=1.0, le=1000.0, default=20.0)


class JogSettings(Strict):
    """How fast a group is jogged at most: its tool's centre, by any jog (a person may be near)."""

    tool_speed_max: Positive = Field(alias="tool_speed_max_m_s", default=0.25)


class Group(Strict):
    """Axes that move together under one path clock. `tool`: the tool's frame in the flange's, the last link's frame."""

    name: Name
    base: Pose = Pose()
    tool: Pose = Pose()
    urdf: Urdf | None = None
    path: PathSettings = PathSettings()
    jog: JogSettings = JogSettings()
    homing_together: bool = False
    """`home` homes all axes at once, instead of one after the other in the order of the file."""
    axes: tuple[Axis, ...] = Field(min_length=1, max_length=64)

    @model_validator(mode="after")
    def _described_once(self) -> Self:
        if self.urdf is None:
            named = [axis.name for axis in self.axes if axis.joint is not None]
            if named:
                raise ValueError(f"axis {named[0]} names a joint, but the group has no urdf")
            return self
        rows = [axis.name for axis in self.axes if axis.dh is not None]
        if rows:
            raise ValueError(f"axis {rows[0]} has a dh row, but the group's chain comes from {self.urdf.file}")
        self.urdf.check_joints({axis.name: joint for axis, joint in zip(self.axes, self.joint_names, strict=True)})
        return self

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Of each axis in the URDF file."""
        return tuple(axis.joint or axis.name for axis in self.axes)

    @cached_property
    def has_chain(self) -> bool:
        """The file says where its links are."""
        return self.urdf is not None or all(axis.dh is not None for axis in self.axes)


class Box(Strict):
    """Something solid that stands still in the cell's frame O: its middle's pose and its edges (m)."""

    name: Name
    pose: Pose = Pose()
    size: tuple[Positive, Positive, Positive] = Field(alias="size_m")


class Geometry(Strict):
    """What links must keep away from. A pair names two boxes or axes, an axis standing for the link that it turns."""

    margin: float = Field(alias="margin_m", ge=0, default=0.005)
    boxes: tuple[Box, ...] = Field(max_length=64, default=())
    allowed: tuple[tuple[Name, Name], ...] = ()
    """Never checked: they touch by construction."""
    contacts: tuple[tuple[Name, Name], ...] = ()
    """Checked, but for a step of a program that declares the contact (a tool change)."""


class Compound(Strict):
    """Groups that can also be moved as one; stopping a member stops all."""

    name: Name
    members: tuple[Name, ...] = Field(min_length=2)


class Cell(Strict):
    """The whole cell file, checked. Axes are numbered through all groups in the order of the file."""

    schema_version: Literal[1] = Field(alias="schema")
    name: Name
    period: Milliseconds = Field(alias="period_ms")
    missed_ticks_max: int = Field(ge=1, le=50, default=5)
    tpdo_missed_max: int = Field(ge=1, le=50, default=3)
    controller_node_id: int = Field(ge=1, le=127, default=127)
    controller_heartbeat: Milliseconds = Field(alias="controller_heartbeat_ms", default=20.0)
    controller_heartbeat_timeout: Milliseconds = Field(alias="controller_heartbeat_timeout_ms", default=60.0)
    drive_heartbeat: Milliseconds = Field(alias="drive_heartbeat_ms", default=100.0)
    drive_heartbeat_timeout: Milliseconds = Field(alias="drive_heartbeat_timeout_ms", default=250.0)
    buses: tuple[Bus, ...] = Field(min_length=1, max_length=8)
    groups: tuple[Group, ...] = Field(min_length=1, max_length=16)
    compounds: tuple[Compound, ...] = ()
    geometry: Geometry = Geometry()
    recorder: Recording = Recording()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        _unique("buses", [bus.name for bus in self.buses])
        _unique("groups and compounds", [g.name for g in self.groups] + [c.name for c in self.compounds])
        _unique("axes", [axis.name for axis in self.axes])
        buses = {bus.name for bus in self.buses}
        for axis in self.axes:
            if axis.drive.bus not in buses:
                raise ValueError(f"axis {axis.name}: drive.bus {axis.drive.bus!r} is none of {sorted(buses)}")
            if axis.drive.node_id == self.controller_node_id:
                raise ValueError(f"axis {axis.name}: node_id {axis.drive.node_id} is the controller's own")
        _unique("drives on one bus (bus:node_id)", [f"{a.drive.bus}:{a.drive.node_id}" for a in self.axes])
        names = {group.name for group in self.groups}
        for compound in self.compounds:
            for member in compound.members:
                if member not in names:
                    raise ValueError(f"compound {compound.name}: member {member!r} is none of {sorted(names)}")
            _unique(f"members of {compound.name}", list(compound.members))
        if "all" in names | {c.name for c in self.compounds}:
            raise ValueError('a group cannot be called "all": commands use that name for every group')
        return self

    @model_validator(mode="after")
    def _solid(self) -> Self:
        names = [axis.name for axis in self.axes] + [box.name for box in self.geometry.boxes]
        _unique("boxes and axes", names)
        for pair in (*self.geometry.allowed, *self.geometry.contacts):
            for name in pair:
                if name not in names:
                    raise ValueError(f"geometry: {name!r} is neither an axis nor a box")
            if pair[0] == pair[1]:
                raise ValueError(f"geometry: the pair {pair[0]!r} with itself")
        for group in self.groups:
            shaped = [a.name for a in group.axes if a.radius is not None or a.capsules]
            if shaped and not group.has_chain:
                flat = next(a.name for a in group.axes if a.dh is None)
                raise ValueError(f"axis {shaped[0]} has a shape, so {flat} needs a dh row to place it")
        return self

    @cached_property
    def axes(self) -> tuple[Axis, ...]:
        """All axes, group by group."""
        return tuple(axis for group in self.groups for axis in group.axes)

    @cached_property
    def group_names(self) -> tuple[str, ...]:
        """Elementary groups, in the order of the file."""
        return tuple(group.name for group in self.groups)

    @cached_property
    def period_ns(self) -> int:
        """The cycle's period in whole nanoseconds."""
        return round(self.period * 1e9)

    def on_simcan(self, directory: str) -> "Cell":
        """The same cell with every bus on simcan, its socket in `directory`."""
        buses = tuple(
            bus.model_copy(update={"interface": "simcan", "channel": f"{directory}/{bus.name}.sock"})
            for bus in self.buses
        )
        return self.model_copy(update={"buses": buses})

    def members(self, name: str) -> tuple[int, ...]:
        """Indices of the elementary groups that `name` stands for: a group, a compound or "all".

        Raises:
            KeyError: no such group.
        """
        if name == "all":
            return tuple(range(len(self.groups)))
        if name in self.group_names:
            return (self.group_names.index(name),)
        for compound in self.compounds:
            if compound.name == name:
                return tuple(sorted(self.group_names.index(member) for member in compound.members))
        raise KeyError(name)

    def axis_indices(self, name: str) -> tuple[int, ...]:
        """Indices, in `axes`, of what a group or compound moves; a compound's are in the order of the file."""
        return tuple(i for member in self.members(name) for i in self._axes_of_group[member])

    @cached_property
    def _axes_of_group(self) -> tuple[tuple[int, ...], ...]:
        firsts = [0]
        for group in self.groups:
            firsts.append(firsts[-1] + len(group.axes))
        return tuple(tuple(range(a, b)) for a, b in pairwise(firsts))


def _unique(what: str, names: list[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"{what}: {', '.join(twice)} more than once")


def parse_cell(text: str, source: str = "cell file") -> Cell:
    """The checked cell; the text holds the files that it names (`with_files`).

    Raises:
        CellError: not TOML (with line and column), or a wrong, unknown or missing key (with its path).
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        where = f"(at line {len(text.splitlines())}, the end of the file)"
        raise CellError(f"{source}: {str(error).replace('(at end of document)', where)}") from None
    try:
        # Through JSON, so that TOML's arrays become tuples under strict types.
        return Cell.model_validate_json(json.dumps(with_texts(with_defaults(data)), default=str))
    except ValidationError as error:
        lines = [f"{source}: {_path(e['loc'])}: {e['msg'].removeprefix('Value error, ')}" for e in _causes(error)]
        raise CellError("\n".join(lines)) from None


def _causes(error: ValidationError) -> list[ErrorDetails]:
    """Its faults without those that follow from others: a list whose only item is refused also counts as empty."""
    faults = error.errors()
    inside = {fault["loc"][:depth] for fault in faults for depth in range(len(fault["loc"]))}
    return [fault for fault in faults if fault["type"] != "too_short" or fault["loc"] not in inside]


def override(text: str, values: dict[str, float | int]) -> str:
    """The cell file's text with these top-level keys set anew; everything else, comments too, stays."""
    lines = text.splitlines()
    first_table = next((i for i, line in enumerate(lines) if line.lstrip().startswith("[")), len(lines))
    kept = [line for line in lines[:first_table] if line.partition("=")[0].strip() not in values]
    while kept and not kept[-1].strip():
        kept.pop()
    return "\n".join([*kept, *(f"{key} = {value}" for key, value in values.items()), "", *lines[first_table:], ""])


def _path(loc: tuple[int | str, ...]) -> str:
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in loc).lstrip(".")
    return text or "the whole file"


def read_cell(path: Path) -> tuple[Cell, str]:
    """The checked cell and the file's text, with the files that it names: complete, for the log and other processes.

    Raises:
        CellError: unreadable, or refused as by `parse_cell`.
    """
    try:
        text = with_files(path.read_text(encoding="utf-8"), path.parent)
    except FileMissing as error:
        raise CellError(f"{path}: {error}") from None
    except OSError as error:
        raise CellError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise CellError(f"{path}: cannot be read: it is not UTF-8") from None
    return parse_cell(text, str(path)), text
