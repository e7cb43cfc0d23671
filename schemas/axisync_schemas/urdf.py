"""A URDF file (ROS, urdf/XML): which chain of joints leads from link to link, and what its links are shaped like.

Only what needs no kinematics: names, kinds, limits, shapes. Placements are the arm model's business.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self
from xml.etree import ElementTree

from pydantic import Field, model_validator

from axisync_schemas.base import Strict

TURNING = ("revolute", "continuous")
SOLID = ("sphere", "cylinder", "box")


class UrdfError(ValueError):
    """The file is refused; the message is a sentence."""


@dataclass(frozen=True, slots=True)
class UrdfJoint:
    """A joint; `limits` in rad, None where it has none."""

    name: str
    kind: str
    parent: str
    child: str
    mimics: bool
    limits: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class UrdfShape:
    """A collision shape in its link's frame: `xyz` m and fixed-axis `rpy` rad of its middle.

    `size`: radius; radius and length (along z); edges; nothing of a mesh.
    """

    kind: str
    size: tuple[float, ...]
    xyz: tuple[float, ...]
    rpy: tuple[float, ...]


@dataclass(frozen=True)
class UrdfTree:
    """Links and joints, checked to be a tree."""

    links: dict[str, tuple[UrdfShape, ...]]
    above: dict[str, UrdfJoint] = field(repr=False)
    """The joint above each link but the root."""

    @property
    def root(self) -> str:
        """The link with no joint above it."""
        return next(link for link in self.links if link not in self.above)

    def upwards(self, link: str) -> Iterator[UrdfJoint]:
        """The joints from a link to the root."""
        while link in self.above:
            yield self.above[link]
            link = self.above[link].parent

    def chain(self, base: str, tip: str) -> tuple[UrdfJoint, ...]:
        """The joints from link to link, fixed ones too.

        Raises:
            UrdfError: no such link, or the base is not above the tip.
        """
        for link in (base, tip):
            if link not in self.links:
                raise UrdfError(f"there is no link {link!r}; there are {', '.join(sorted(self.links))}")
        joints = []
        for joint in self.upwards(tip):
            if joint.child == base:
                break
            joints.append(joint)
        if (joints[-1].parent if joints else tip) != base:
            raise UrdfError(f"link {tip!r} does not hang on link {base!r}")
        return tuple(reversed(joints))

    def bearer(self, link: str) -> UrdfJoint | None:
        """The joint that moves this link: the next one above that is not fixed; None: nothing moves it."""
        return next((joint for joint in self.upwards(link) if joint.kind != "fixed"), None)


class Urdf(Strict):
    """A URDF file beside the cell file, and the links in it that are the arm's base and its flange.

    `base` is the file's outermost link where it is not given. `text` is filled in when the cell file is read.
    """

    file: str = Field(min_length=1)
    tip: str
    base: str | None = None
    text: str = Field(default="", repr=False)

    @model_validator(mode="after")
    def _readable(self) -> Self:
        if not self.text:
            raise ValueError(f"{self.file}: its text is missing")
        try:
            self.tree.chain(self.root, self.tip)
        except UrdfError as error:
            raise ValueError(f"{self.file}: {error}") from None
        return self

    @cached_property
    def tree(self) -> UrdfTree:
        """Its links and joints."""
        return read_urdf(self.text)

    @property
    def root(self) -> str:
        """The arm's base."""
        return self.base or self.tree.root

    @cached_property
    def chain(self) -> tuple[UrdfJoint, ...]:
        """The joints from base to tip that are not fixed."""
        return tuple(joint for joint in self.tree.chain(self.root, self.tip) if joint.kind != "fixed")

    def check_joints(self, axes: dict[str, str]) -> None:
        """Axes {name: joint's name} must be the chain's joints, one for one, in their order.

        Raises:
            ValueError: with the joint and the axis that do not fit.
        """
        where = f"{self.file}, {self.root} to {self.tip}"
        chain = [joint.name for joint in self.chain]
        for axis, name in axes.items():
            if name not in chain:
                raise ValueError(f"axis {axis}: {where}: there is no joint {name!r}; there are {', '.join(chain)}")
        for joint in self.chain:
            if joint.name not in axes.values():
                raise ValueError(f"{where}: joint {joint.name!r} has no axis")
            if joint.mimics:
                raise ValueError(f"{where}: joint {joint.name!r} mimics another; an axis moves by itself")
            if joint.kind not in TURNING:
                raise ValueError(f"{where}: joint {joint.name!r} is {joint.kind}; axes turn ({' or '.join(TURNING)})")
        if chain != list(axes.values()):
            raise ValueError(f"{where}: the axes are not in the order of the joints, {', '.join(chain)}")


def read_urdf(text: str) -> UrdfTree:
    """The tree.

    Raises:
        UrdfError: not XML, not a URDF, a number that is none, or links that form no single tree.
    """
    try:
        robot = ElementTree.fromstring(text.strip())
    except ElementTree.ParseError as error:
        raise UrdfError(f"not XML: {error}") from None
    if robot.tag != "robot":
        raise UrdfError(f"the outermost element is <{robot.tag}>, a URDF's is <robot>")
    if any(str(element.tag).startswith("{") for element in robot.iter()):
        raise UrdfError("elements of a macro language are left in it: expand it first (xacro FILE > arm.urdf)")
    links = {_named(link): tuple(_shapes(link)) for link in robot.findall("link")}
    joints = [_joint(element) for element in robot.findall("joint")]
    _unique("link", [_named(link) for link in robot.findall("link")])
    _unique("joint", [joint.name for joint in joints])
    above: dict[str, UrdfJoint] = {}
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise UrdfError(f"joint {joint.name!r} names link {link!r}, which there is not")
        if joint.child in above:
            raise UrdfError(f"link {joint.child!r} hangs on two joints, {above[joint.child].name!r} and {joint.name!r}")
        above[joint.child] = joint
    tree = UrdfTree(links, above)
    _check_tree(tree)
    return tree


def _check_tree(tree: UrdfTree) -> None:
    for link in tree.links:
        for count, joint in enumerate(tree.upwards(link)):
            if count > len(tree.links):
                raise UrdfError(f"joint {joint.name!r} is in a loop: links must form a tree")
    roots = sorted(link for link in tree.links if link not in tree.above)
    if len(roots) != 1:
        raise UrdfError(f"links hang together in {len(roots)} trees, under {', '.join(roots)}; one is expected")


def _joint(element: ElementTree.Element) -> UrdfJoint:
    name, kind = _named(element), element.get("type", "")
    ends = [end.get("link", "") for tag in ("parent", "child") if (end := element.find(tag)) is not None]
    if len(ends) != 2:
        raise UrdfError(f"joint {name!r} needs a parent and a child")
    where = f"joint {name!r}"
    _origin(element, where)
    axis = element.find("axis")
    if axis is not None and not any(_numbers(axis, "xyz", 3, where)):
        raise UrdfError(f"{where}: its axis is zero")
    limit = element.find("limit")
    if limit is None and kind in ("revolute", "prismatic"):
        raise UrdfError(f"{where} is {kind} and needs a <limit>")
    limits = None
    if limit is not None and kind == "revolute":
        limits = (_numbers(limit, "lower", 1, where)[0], _numbers(limit, "upper", 1, where)[0])
    return UrdfJoint(name, kind, ends[0], ends[1], element.find("mimic") is not None, limits)


def _shapes(link: ElementTree.Element) -> Iterator[UrdfShape]:
    where = f"link {_named(link)!r}"
    for collision in link.findall("collision"):
        geometry = collision.find("geometry")
        shape = None if geometry is None else next(iter(geometry), None)
        if shape is None:
            raise UrdfError(f"{where}: a collision without a shape")
        sizes = {"sphere": (("radius", 1),), "cylinder": (("radius", 1), ("length", 1)), "box": (("size", 3),)}
        size = [x for key, count in sizes.get(shape.tag, ()) for x in _numbers(shape, key, count, where)]
        if any(x <= 0.0 for x in size):
            raise UrdfError(f"{where}: a {shape.tag} of size {size}")
        xyz, rpy = _origin(collision, where)
        yield UrdfShape(shape.tag, tuple(size), xyz, rpy)


def _origin(element: ElementTree.Element, where: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    origin = element.find("origin")
    if origin is None:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return _numbers(origin, "xyz", 3, where), _numbers(origin, "rpy", 3, where)


def _numbers(element: ElementTree.Element, key: str, count: int, where: str) -> tuple[float, ...]:
    """Zeros where the attribute is missing, as the format has it."""
    words = element.get(key, " ".join(["0"] * count)).split()
    try:
        numbers = tuple(float(word) for word in words)
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(math.isfinite(x) for x in numbers):
        raise UrdfError(f"{where}: {key}={element.get(key)!r} is not {count} finite numbers")
    return numbers


def _named(element: ElementTree.Element) -> str:
    name = element.get("name", "")
    if not name:
        raise UrdfError(f"a {element.tag} without a name")
    return name


def _unique(what: str, names: list[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise UrdfError(f"{what} {', '.join(twice)} more than once")
