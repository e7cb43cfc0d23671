"""Where front listens, and what the session forbids."""

import json
import socket

import pytest
import zenoh

from axisync_service.hmi.session import ListenError, access_control, check_listen, open_session, settings


@pytest.mark.parametrize("listen", ["tcp/127.0.0.1:7447", "tcp/127.9.8.7:1", "tcp/localhost:7447", "tcp/[::1]:7447"])
def test_loopback_is_served(listen: str) -> None:
    check_listen(listen)


@pytest.mark.parametrize("listen", ["tcp/0.0.0.0:7447", "tcp/[::]:7447", "tcp/192.168.1.5:7447", "tcp/robot:7447"])
def test_nothing_else_is_without_authentication(listen: str) -> None:
    with pytest.raises(ListenError, match="only loopback") as caught:
        check_listen(listen)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    "listen", ["", "7447", "udp/127.0.0.1:7447", "tcp/127.0.0.1", "tcp/127.0.0.1:99999", "tcp/::1:7"]
)
def test_malformed_addresses(listen: str) -> None:
    with pytest.raises(ListenError, match="not of the form"):
        check_listen(listen)


def test_an_address_in_use_is_one_sentence() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        with pytest.raises(ListenError, match="cannot listen on") as caught:
            open_session(f"tcp/127.0.0.1:{other.getsockname()[1]}")
    assert len(str(caught.value).splitlines()) == 1


def test_zenoh_knows_every_setting() -> None:
    config = zenoh.Config()
    for key, value in settings("tcp/127.0.0.1:7447").items():
        config.insert_json5(key, json.dumps(value))
    assert json.loads(config.get_json("transport/shared_memory/enabled")) is False
    assert json.loads(config.get_json("scouting/multicast/enabled")) is False
    assert json.loads(config.get_json("scouting/gossip/enabled")) is False


def test_nobody_may_serve_or_publish() -> None:
    allowed = {
        message for rule in access_control()["rules"] if "ingress" in rule["flows"] for message in rule["messages"]
    }
    assert access_control()["default_permission"] == "deny"
    assert allowed.isdisjoint({"put", "delete", "reply", "declare_queryable", "liveliness_token"})
