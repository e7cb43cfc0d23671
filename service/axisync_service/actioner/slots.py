"""Plan slots: the least recently used one that nobody references."""

from collections.abc import Collection

from axisync_schemas.memory import PLAN_SLOTS


class Slots:
    """Gives slots away in turn, so that readers of an ended plan have time: it is rewritten as late as possible."""

    def __init__(self, count: int = PLAN_SLOTS) -> None:
        self._order = list(range(count))

    def take(self, referenced: Collection[int]) -> int | None:
        """A slot outside `referenced`, or None where all are in use."""
        for slot in self._order:
            if slot not in referenced:
                self._order.remove(slot)
                self._order.append(slot)
                return slot
        return None
