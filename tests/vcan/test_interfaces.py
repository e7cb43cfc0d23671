"""The kernel's vcan through python-can: what the controller's back end and the emulator rely on."""

import subprocess

import can
import pytest

pytestmark = pytest.mark.vcan
CHANNELS = ("vcan0", "vcan1")


@pytest.mark.parametrize("channel", CHANNELS)
def test_a_frame_arrives_whole_and_is_not_echoed(channel: str) -> None:
    frame = can.Message(arbitration_id=0x201, data=bytes(range(8)), is_extended_id=False)
    with can.Bus(channel=channel, interface="socketcan") as ours, can.Bus(channel, "socketcan") as theirs:
        ours.send(frame)
        received = theirs.recv(timeout=5.0)
        assert received is not None
        assert (received.arbitration_id, bytes(received.data)) == (0x201, bytes(range(8)))
        assert not received.is_extended_id
        assert ours.recv(timeout=0.05) is None


def test_the_buses_are_apart() -> None:
    with can.Bus("vcan0", "socketcan") as first, can.Bus("vcan1", "socketcan") as second:
        first.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        assert second.recv(timeout=0.1) is None


@pytest.mark.parametrize("channel", CHANNELS)
def test_every_frame_of_a_cycle_arrives_in_order(channel: str) -> None:
    """SYNC, then an RPDO for each of six drives."""
    identifiers = [0x80, *(0x200 + node for node in range(1, 7))]
    with can.Bus(channel, "socketcan") as ours, can.Bus(channel, "socketcan") as theirs:
        for identifier in identifiers:
            ours.send(can.Message(arbitration_id=identifier, data=b"\x0f\x00abcd", is_extended_id=False))
        received = [theirs.recv(timeout=5.0) for _ in identifiers]
        assert [frame and frame.arbitration_id for frame in received] == identifiers


def test_the_interfaces_are_vcan_and_setting_them_up_again_changes_nothing(pytestconfig: pytest.Config) -> None:
    script = pytestconfig.rootpath / "deploy" / "vcan.sh"
    again = subprocess.run([script], capture_output=True, text=True, check=False)
    assert (again.returncode, again.stdout) == (0, "vcan0 up\nvcan1 up\n")
    for channel in CHANNELS:
        shown = subprocess.run(["ip", "-details", "link", "show", channel], capture_output=True, text=True, check=True)
        assert "vcan" in shown.stdout.split()


def test_set_up_and_down_of_a_named_interface(pytestconfig: pytest.Config) -> None:
    script = pytestconfig.rootpath / "deploy" / "vcan.sh"

    def run(*arguments: str) -> int:
        return subprocess.run([script, *arguments], capture_output=True, check=False).returncode

    assert run("vcan7") == 0
    with can.Bus("vcan7", "socketcan") as bus:
        bus.send(can.Message(arbitration_id=1, is_extended_id=False))
    assert run("--down", "vcan7") == 0
    assert subprocess.run(["ip", "link", "show", "vcan7"], capture_output=True, check=False).returncode != 0
    assert run("--down", "vcan7") == 0
    assert run("--down", "lo") == 1
