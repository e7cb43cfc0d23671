"""What `plan` and `move` can be asked for: the options that describe a move, and the move that they describe."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import typer

from axisync_cli import quantities
from axisync_cli.options import in_words
from axisync_client import InvalidArgument, Program, moves
from axisync_client.moves import AnyMove, build
from axisync_client.program import load

TIMED = frozenset({"minimise", "duration", "pulse"})
ALONG = TIMED | {"quaternion", "euler", "frame", "linear_limits", "angular_limits", "orientation", "retime"}
GOES_WITH: dict[str, frozenset[str]] = {
    "joint": TIMED | {"relative"},
    "linear": ALONG | {"relative"},
    "circular": ALONG | {"via"},
    "file": frozenset(),
}
"""Which options mean something beside the one that says where to."""
KINDS = ", ".join(f"--{kind}" for kind in GOES_WITH)


@dataclass(frozen=True, slots=True)
class Numbers:
    """Several numbers of one option, SI. A class of its own, or typer reads a tuple as several words."""

    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Place:
    """x, y, z in m, of one member of a compound group where it is named."""

    member: str | None
    position: tuple[float, ...]


def numbers(parse: Callable[[str], tuple[float, ...]]) -> Callable[[Any], Any]:
    """A parser of `Numbers`, for an option."""
    return in_words(lambda text: Numbers(parse(text)))


def _option(flag: str, metavar: str, parse: Callable[[str], tuple[float, ...]], text: str) -> Any:
    return typer.Option(flag, metavar=metavar, parser=numbers(parse), help=text)


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """The words of one command line."""

    group: Annotated[
        str | None, typer.Argument(metavar="GROUP", help="A group or a compound; with --file, that of the file.")
    ] = None
    joint: Annotated[
        Numbers | None,
        _option(
            "--joint",
            "VALUES",
            quantities.joint_target,
            "To these axis values: -90,60,-45,0,0,0deg, or 90deg,0.5rad,...; without a unit they are radians.",
        ),
    ] = None
    linear: Annotated[
        list[Place] | None,
        typer.Option(
            "--linear",
            metavar="X,Y,Z",
            parser=in_words(lambda text: Place(*quantities.member_and_point(text))),
            help="In a straight line of the tool: 300,0,120mm; of a compound NAME=X,Y,Z for each that moves.",
        ),
    ] = None
    circular: Annotated[
        Numbers | None, _option("--circular", "X,Y,Z", quantities.point, "In an arc of the tool, through --via.")
    ] = None
    file: Annotated[
        Path | None,
        typer.Option("--file", metavar="FILE", help="A program, FILE.toml, or a move as on the wire, FILE.json."),
    ] = None
    via: Annotated[Numbers | None, _option("--via", "X,Y,Z", quantities.point, "A point on the arc.")] = None
    quaternion: Annotated[
        Numbers | None,
        _option("--quaternion", "X,Y,Z,W", quantities.quaternion, "Orientation at the end; else it keeps its own."),
    ] = None
    euler: Annotated[
        Numbers | None, _option("--euler", "A,B,G", quantities.euler, "The same by intrinsic ZYZ angles: 0,90,0deg.")
    ] = None
    frame: Annotated[
        quantities.Frame,
        typer.Option("--frame", help="What positions are given in: the arm's base, the body O, the tool."),
    ] = quantities.Frame.BASE
    relative: Annotated[
        bool, typer.Option("--relative", help="Add the values to the present setpoint, or to where the tool is.")
    ] = False
    linear_limits: Annotated[
        Numbers | None,
        _option("--linear-limits", "V,A,J", quantities.linear_limits, "Along the path: 150,200,300mm."),
    ] = None
    angular_limits: Annotated[
        Numbers | None, _option("--angular-limits", "V,A,J", quantities.angular_limits, "Of its turning: 30,40,80deg.")
    ] = None
    orientation: Annotated[
        quantities.Orientation,
        typer.Option("--orientation", help="How it turns: about one axis, or each ZYZ angle for itself."),
    ] = quantities.Orientation.ROTATION_VECTOR
    retime: Annotated[
        bool,
        typer.Option("--retime/--no-retime", help="Stretch a path until every joint keeps its limits, or refuse it."),
    ] = True
    minimise: Annotated[
        quantities.Minimise,
        typer.Option("--minimise", help="Which limit to lower on what has time to spare."),
    ] = quantities.Minimise.ACCELERATION
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration",
            metavar="SECONDS",
            parser=in_words(quantities.duration_s),
            help="Take this long instead of the shortest possible time.",
        ),
    ] = None
    pulse: Annotated[
        quantities.Pulse, typer.Option("--pulse", help="Shape of the jerk; with parabolic the jerk is continuous.")
    ] = quantities.Pulse.CONSTANT

    def program(self) -> Program:
        """What is asked for, checked.

        Raises:
            InvalidArgument: options that do not go together, or a file that is refused.
        """
        kind = self._kind()
        if kind == "file":
            return self._of_file()
        if self.group is None:
            raise InvalidArgument("GROUP is missing", "say which group is to move; `axisync state` shows them")
        return build(Program, name=kind, group=self.group, move=self._move(kind))

    def _kind(self) -> str:
        given = [kind for kind in GOES_WITH if getattr(self, kind)]
        if len(given) != 1:
            what = "where to is missing" if not given else f"--{' and --'.join(given)} are two moves"
            raise InvalidArgument(what, f"give one of {KINDS}")
        kind = given[0]
        for field in fields(self):
            if field.name in GOES_WITH or field.name in GOES_WITH[kind] | {"group"}:
                continue
            if getattr(self, field.name) != field.default:
                others = [f"--{other}" for other, names in GOES_WITH.items() if field.name in names]
                name = field.name.replace("_", "-") if field.name != "retime" else "no-retime"
                raise InvalidArgument(f"--{name} does not go with --{kind}", f"it goes with {', '.join(others)}")
        return kind

    def _of_file(self) -> Program:
        assert self.file is not None
        program = load(self.file)
        if self.group not in (None, program.group):
            raise InvalidArgument(f"{self.file} is for {program.group}, not for {self.group}")
        return program

    def _move(self, kind: str) -> AnyMove:
        timing: dict[str, Any] = {
            "minimise": self.minimise.value,
            "duration_s": self.duration,
            "pulse": self.pulse.value,
        }
        if kind == "joint" and self.joint is not None:
            return moves.joint(self.joint.values, relative=self.relative, **timing)
        along = timing | {
            "frame": self.frame.value,
            "quaternion": _values(self.quaternion),
            "euler_zyz": _values(self.euler),
            "linear_limits": _values(self.linear_limits),
            "angular_limits": _values(self.angular_limits),
            "orientation": self.orientation.value,
            "retime": self.retime,
        }
        if self.linear:
            return moves.linear(self._targets(self.linear), relative=self.relative, **along)
        if self.circular is None or self.via is None:
            raise InvalidArgument("--via is missing", "an arc needs a point on it, --via X,Y,Z")
        return moves.circular(self.via.values, self.circular.values, **along)

    def _targets(self, places: list[Place]) -> tuple[float, ...] | dict[str, moves.Place]:
        if len(places) == 1 and places[0].member is None:
            return places[0].position
        if self.quaternion or self.euler:
            raise InvalidArgument("one orientation for several targets", "write each with its own into a --file")
        targets: dict[str, moves.Place] = {place.member: place.position for place in places if place.member}
        if len(targets) < len(places):
            raise InvalidArgument("several --linear for one group", "write each as NAME=X,Y,Z, with names that differ")
        return targets


def _values(numbers: Numbers | None) -> tuple[float, ...] | None:
    return None if numbers is None else numbers.values


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the fields of its parameter `asked` as parameters of their own, as typer wants them."""
    parameters: list[inspect.Parameter] = []
    for parameter in inspect.signature(command).parameters.values():
        if parameter.name == "asked":
            parameters += [
                inspect.Parameter(field.name, parameter.KEYWORD_ONLY, default=field.default, annotation=field.type)
                for field in fields(Asked)
            ]
        else:
            parameters.append(parameter.replace(kind=parameter.KEYWORD_ONLY))

    def run(**given: Any) -> None:
        command(asked=Asked(**{field.name: given.pop(field.name) for field in fields(Asked)}), **given)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return run
