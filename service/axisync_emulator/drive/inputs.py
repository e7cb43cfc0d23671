"""Digital inputs 0x60FD: limit switches, home switch, safe torque off (CiA 402-2, 'Digital inputs')."""

from enum import IntFlag

from axisync_emulator.drive.specification import DriveSpecification


class Input(IntFlag):
    """Bits of 0x60FD."""

    NEGATIVE_LIMIT = 1
    POSITIVE_LIMIT = 2
    HOME = 4
    INTERLOCK = 8
    """Safe torque off is requested."""


class Inputs:
    """The switches along the axis, by its mechanical position (counts), and the safety input.

    Attributes:
        forced: switches that are stuck, and at what: 1 active, 0 not.
    """

    def __init__(self, specification: DriveSpecification) -> None:
        self._low, self._high = specification.limit_switches
        self._home = specification.home_switch
        self.torque_off = False
        self.forced: dict[Input, bool] = {}

    def edge(self, switch: Input) -> float:
        """Where the switch changes, counts."""
        return {Input.NEGATIVE_LIMIT: self._low, Input.POSITIVE_LIMIT: self._high}.get(switch, self._home)

    def active(self, switch: Input, mechanical: float) -> bool:
        """The negative limit switch acts below its edge, the others above theirs."""
        if switch in self.forced:
            return self.forced[switch]
        edge = self.edge(switch)
        return mechanical <= edge if switch is Input.NEGATIVE_LIMIT else mechanical >= edge

    def word(self, mechanical: float) -> int:
        """0x60FD."""
        word = Input.INTERLOCK if self.torque_off else Input(0)
        for switch in (Input.NEGATIVE_LIMIT, Input.POSITIVE_LIMIT, Input.HOME):
            if self.active(switch, mechanical):
                word |= switch
        return int(word)
