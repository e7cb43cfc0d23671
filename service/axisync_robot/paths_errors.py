"""Why there is no such path: each refusal says what is wrong, with its number, and what would be right."""


class PathError(ValueError):
    """No such path. Attributes: `value` (what is wrong) and `bound` (what it must keep), in the message's units."""

    def __init__(self, value: float, bound: float, *more: object) -> None:
        self.value, self.bound = value, bound
        super().__init__(value, bound, *more)


class OutOfRange(PathError):
    """A number of the request is too large, or none. Attributes: `name`, `value`, `bound`, `unit`."""

    def __init__(self, value: float, bound: float, name: str, unit: str) -> None:
        self.name, self.unit = name, unit
        super().__init__(value, bound, name, unit)

    def __str__(self) -> str:
        return f"{self.name}: {self.value:.6g} {self.unit}; at most {self.bound:g} {self.unit} either way"


class EqualArcPoints(PathError):
    """Two of an arc's points are one. Attributes: `first`, `second` (their names), `value` (m apart), `bound` (m)."""

    def __init__(self, value: float, bound: float, first: str, second: str) -> None:
        self.first, self.second = first, second
        super().__init__(value, bound, first, second)

    def __str__(self) -> str:
        fix = (
            "give a via between start and target"
            if "via" in (self.first, self.second)
            else 'for a whole turn use a path with the curve "circle"'
        )
        return (
            f"{self.first} and {self.second} of the arc are {self.value:.3g} m apart: at least {self.bound:g} m; {fix}"
        )


class CollinearArcPoints(PathError):
    """An arc's points lie on a line, as far as can be told.

    Attributes: `value` (m from via to the line through start and target), `bound` (the least, m, that keeps the radius
    within `radius_max`), `radius_max` (m).
    """

    def __init__(self, value: float, bound: float, radius_max: float) -> None:
        self.radius_max = radius_max
        super().__init__(value, bound, radius_max)

    def __str__(self) -> str:
        return (
            f"the arc's points are collinear: via is {self.value:.3g} m from the line through start and target, and "
            f"must be at least {self.bound:.3g} m from it (a radius of {self.radius_max:g} m); use a linear move"
        )


class StartOnAxis(PathError):
    """The tool stands on the circle's axis. Attributes: `value` (m from it), `bound` (m)."""

    def __str__(self) -> str:
        return (
            f"the start is {self.value:.3g} m from the axis of the circle: at least {self.bound:g} m of radius; "
            "move the centre, or use a linear move"
        )


class ZeroNormal(PathError):
    """The normal has no direction. Attributes: `value` (its length), `bound`."""

    def __str__(self) -> str:
        return f"the normal has length {self.value:.3g}: it must be at least {self.bound:g} to give a direction"


class ZeroCurve(PathError):
    """The curve goes nowhere. Attributes: `curve` (its name), `value` (m), `bound` (m)."""

    def __init__(self, value: float, bound: float, curve: str) -> None:
        self.curve = curve
        super().__init__(value, bound, curve)

    def __str__(self) -> str:
        return (
            f"the {self.curve} is {self.value:.3g} m long: at least {self.bound:g} m; "
            "to turn the tool on the spot use a linear move"
        )


class Cusp(PathError):
    """A Lissajous curve stops and turns back: by its length it is not smooth there.

    Attributes: `value` (lowest speed by u over the highest), `bound` (of it), `u` (where, 0 to 1).
    """

    def __init__(self, value: float, bound: float, u: float) -> None:
        self.u = u
        super().__init__(value, bound, u)

    def __str__(self) -> str:
        return (
            f"the Lissajous curve has a cusp at u = {self.u:.6g}: its speed by u falls to {self.value:.3g} of the "
            f"highest, at least {self.bound:g} is needed; change a phase, or end the curve before it"
        )
