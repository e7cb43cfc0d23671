"""Temperature, voltage, safe torque off: read in turn, said when they leave their bounds and when they are back."""

import pytest

from axisync_schemas.cell import CellError, parse_cell
from axisync_service.canopen.sdo import SdoError
from axisync_service.drives.health import Health
from support.cells import eod_text

TEXT = eod_text()
MONITOR = """monitor.temperature = { object = "0x2003", scale = 0.1, high = 80 }
monitor.voltage = { object = "0x6079", scale = 0.001, low = 40, high = 60 }
monitor.safe_torque_off = { object = "0x2001", mask = 1 }"""


def health(monitor: str = MONITOR) -> Health:
    head, _, rest = TEXT.partition("[groups.defaults.drive]\n")
    lines = [line for line in rest.splitlines() if not line.startswith("monitor")]
    return Health(parse_cell(head + "[groups.defaults.drive]\n" + monitor + "\n" + "\n".join(lines)).axes[0])


def test_a_value_out_of_bounds_is_said_once_and_when_it_is_back() -> None:
    said: list[tuple[str, bool]] = []
    one = health()
    item = one.temperature
    assert item is not None
    for value in (300, 810, 820, 799, 700, 600):
        one.take(item, value.to_bytes(2, "little", signed=True), lambda text, warning: said.append((text, warning)))
    assert said == [("temperature is 81 degC, the bound is 80 degC", True), ("temperature is 70 degC again", False)]
    assert item.value == 60.0


def test_low_voltage_names_its_bound() -> None:
    said: list[str] = []
    one = health()
    assert one.voltage is not None
    one.take(one.voltage, (39_000).to_bytes(4, "little"), lambda text, _: said.append(text))
    assert said == ["DC link voltage is 39 V, the bound is 40 V"]


def test_safe_torque_off() -> None:
    said: list[tuple[str, bool]] = []
    one = health()
    flag = one.safe_torque_off
    assert flag is not None
    for data in (b"\0", b"\1", b"\1", b"\0"):
        one.take(flag, data, lambda text, warning: said.append((text, warning)))
        assert one.torque_is_off is (data == b"\1")
    assert said == [("safe torque off is active", True), ("safe torque off is released", False)]


def test_a_bit_may_be_active_low() -> None:
    one = health('monitor.safe_torque_off = { object = "0x60FD", mask = 0x01000000, inverted = true }')
    assert one.safe_torque_off is not None
    one.take(one.safe_torque_off, b"\0\0\0\1", lambda *_: None)
    assert not one.torque_is_off
    one.take(one.safe_torque_off, b"\0\0\0\0", lambda *_: None)
    assert one.torque_is_off


def test_what_a_drive_does_not_have_is_not_asked_for_again() -> None:
    one = health()
    assert one.temperature is not None
    assert [one.next() for _ in range(3)] == [one.items[1], one.items[2], one.items[0]]
    one.take(one.temperature, SdoError(0x06020000), lambda *_: None)
    assert one.temperature not in [one.next() for _ in range(6)]
    one.forget()
    assert one.temperature in [one.next() for _ in range(3)]


def test_another_refusal_is_no_reason_to_stop_asking() -> None:
    one = health()
    assert one.voltage is not None
    one.take(one.voltage, SdoError(0x08000022), lambda *_: None)
    assert not one.voltage.absent


@pytest.mark.parametrize("text", ["6079", "0x60790", "0x6079:256", "0x6079:"])
def test_an_object_that_is_none_is_refused_with_its_place(text: str) -> None:
    with pytest.raises(CellError, match="is no object"):
        health(f'monitor.voltage = {{ object = "{text}" }}')
