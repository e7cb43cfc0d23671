"""A home that was found outlives the service: two runs beside drives that stay on."""

import json
from pathlib import Path

import pytest

from axisync_client import Client, Refused
from axisync_schemas.errors import ErrorCode
from support.cells import eod_text, small
from support.daemon import Daemon, running, unhurried

pytestmark = pytest.mark.unhurried

AXIS = "kingkong.2"
STEP = (0.0, -0.02)


def homed(client: Client) -> list[bool | None]:
    """As `state` says it, by drive of kingkong."""
    return [drive.homed for drive in client.state().groups["kingkong"].drives]


def test_an_axis_stays_homed_over_a_restart_of_the_service(tmp_path: Path) -> None:
    text = unhurried(small(eod_text())).replace(
        "drive = { node_id = 2,", "drive = { homing = { method = 37 }, offset_deg = 12, node_id = 2,", 1
    )
    with running(tmp_path, text, drives_apart=True) as daemon:
        first_run(daemon)
        assert daemon.stop() == 0
        (file,) = (tmp_path / "state").rglob("*.homed.json")
        assert list(json.loads(file.read_text())) == [AXIS]
        daemon.start()
        with Client(daemon.endpoint) as client, client.lease("kingkong") as lease:
            assert homed(client) == [None, True]
            lease.enable()
            assert lease.move_joint(STEP, relative=True).wait().status == "succeeded"
        assert daemon.stop() == 0


def first_run(daemon: Daemon) -> None:
    """Refused, homed, moved."""
    with Client(daemon.endpoint) as client, client.lease("kingkong") as lease:
        lease.enable()
        assert homed(client) == [None, False]
        with pytest.raises(Refused) as refusal:
            lease.move_joint(STEP, relative=True)
        assert refusal.value.code is ErrorCode.NOT_HOMED
        lease.home()
        assert homed(client) == [None, True]
        assert lease.move_joint(STEP, relative=True).wait().status == "succeeded"
