"""What the planner refuses, and with which numbers."""


class InvalidLimits(ValueError):
    """A limit, distance or time that no motion can be planned with.

    Attributes: `axis` (index, or None for a single-axis call), `name` (of the argument), `value` (as given),
    `bound` (what is allowed, in words).
    """

    def __init__(self, name: str, value: float, bound: str, axis: int | None = None) -> None:
        self.name = name
        self.value = value
        self.bound = bound
        self.axis = axis
        super().__init__(f"{_where(axis)}{name} = {value!r}: must be {bound}")

    def __reduce__(self) -> tuple[type["InvalidLimits"], tuple[str, float, str, int | None]]:
        return InvalidLimits, (self.name, self.value, self.bound, self.axis)


class InfeasibleDuration(ValueError):
    """The requested duration is shorter than the limits of an axis allow.

    Attributes: `axis` (the limiting axis, or None for a single-axis call), `value` (the requested duration), `bound`
    and `shortest` (both the shortest possible duration).
    """

    def __init__(self, value: float, shortest: float, axis: int | None = None) -> None:
        self.value = value
        self.shortest = shortest
        self.bound = shortest
        self.axis = axis
        super().__init__(f"{_where(axis)}duration = {value!r}: shortest possible is {shortest!r}")

    def __reduce__(self) -> tuple[type["InfeasibleDuration"], tuple[float, float, int | None]]:
        return InfeasibleDuration, (self.value, self.shortest, self.axis)


def _where(axis: int | None) -> str:
    return "" if axis is None else f"axis {axis}: "
