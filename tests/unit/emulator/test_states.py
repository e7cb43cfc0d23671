"""CiA 402-2's state machine, row by row; the expectation is written out here again."""

import itertools

import pytest

from axisync_emulator.drive.states import STATE_MASK, TRANSITIONS, Command, State, command_of

# state, controlword bits 7..0 -> state (CiA 402-2, table 'Command coding' and figure 'Finite state automaton')
SHUTDOWN, SWITCH_ON, ENABLE, NO_VOLTAGE, QUICK_STOP = 0x06, 0x07, 0x0F, 0x00, 0x02
ROWS = [
    ("SWITCH_ON_DISABLED", SHUTDOWN, 2, "READY_TO_SWITCH_ON"),
    ("READY_TO_SWITCH_ON", SWITCH_ON, 3, "SWITCHED_ON"),
    ("READY_TO_SWITCH_ON", ENABLE, 3, "SWITCHED_ON"),
    ("SWITCHED_ON", ENABLE, 4, "OPERATION_ENABLED"),
    ("OPERATION_ENABLED", SWITCH_ON, 5, "SWITCHED_ON"),
    ("SWITCHED_ON", SHUTDOWN, 6, "READY_TO_SWITCH_ON"),
    ("READY_TO_SWITCH_ON", QUICK_STOP, 7, "SWITCH_ON_DISABLED"),
    ("READY_TO_SWITCH_ON", NO_VOLTAGE, 7, "SWITCH_ON_DISABLED"),
    ("OPERATION_ENABLED", SHUTDOWN, 8, "READY_TO_SWITCH_ON"),
    ("OPERATION_ENABLED", NO_VOLTAGE, 9, "SWITCH_ON_DISABLED"),
    ("SWITCHED_ON", QUICK_STOP, 10, "SWITCH_ON_DISABLED"),
    ("SWITCHED_ON", NO_VOLTAGE, 10, "SWITCH_ON_DISABLED"),
    ("OPERATION_ENABLED", QUICK_STOP, 11, "QUICK_STOP_ACTIVE"),
    ("QUICK_STOP_ACTIVE", NO_VOLTAGE, 12, "SWITCH_ON_DISABLED"),
    ("QUICK_STOP_ACTIVE", ENABLE, 16, "OPERATION_ENABLED"),
    ("FAULT", 0x80, 15, "SWITCH_ON_DISABLED"),
]


@pytest.mark.parametrize(("state", "word", "number", "target"), ROWS)
def test_row(state: str, word: int, number: int, target: str):
    command = command_of(word, 0)
    assert command is not None
    row = TRANSITIONS[State[state], command]
    assert (row.number, row.target) == (number, State[target])


def test_no_other_row():
    expected = {(State[state], command_of(word, 0)) for state, word, *_ in ROWS}
    assert set(TRANSITIONS) == expected


def meaning(word: int) -> Command:
    """CiA 402-2, table 'Command coding': bits 7, 3, 2, 1, 0."""
    bit = [word >> i & 1 for i in range(8)]
    if bit[7]:
        return Command.FAULT_RESET
    if not bit[1]:
        return Command.DISABLE_VOLTAGE
    if not bit[2]:
        return Command.QUICK_STOP
    if not bit[0]:
        return Command.SHUTDOWN
    return Command.ENABLE_OPERATION if bit[3] else Command.SWITCH_ON


def test_every_controlword_has_one_meaning():
    for word in range(256):
        assert command_of(word, 0) is command_of(word | 0xFF00, 0) is meaning(word), hex(word)


def test_fault_reset_needs_a_rising_edge():
    assert command_of(0x80, 0x0F) is Command.FAULT_RESET
    assert command_of(0x80, 0x80) is None
    assert command_of(0x86, 0x80) is None


def test_state_codes_are_distinct_under_the_mask():
    for a, b in itertools.combinations(State, 2):
        assert a & STATE_MASK != b & STATE_MASK
