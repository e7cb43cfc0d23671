import pytest

from axisync_client import InvalidArgument
from axisync_client.settings import DEFAULT_ENDPOINT, resolve

ENVIRONMENT = {"AXISYNC_ENDPOINT": "tcp/10.0.0.1:7000", "AXISYNC_CELL": "eod", "AXISYNC_USER": "ann"}


def test_defaults() -> None:
    settings = resolve(None, None, None, {})
    assert (settings.endpoint, settings.cell, settings.user) == (DEFAULT_ENDPOINT, None, "anonymous")


def test_the_environment_stands_in_for_what_is_missing() -> None:
    settings = resolve(None, None, None, ENVIRONMENT)
    assert (settings.endpoint, settings.cell, settings.user) == ("tcp/10.0.0.1:7000", "eod", "ann")


def test_arguments_win() -> None:
    settings = resolve("tls/host:1", "lab", "bob", ENVIRONMENT)
    assert (settings.endpoint, settings.cell, settings.user) == ("tls/host:1", "lab", "bob")


def test_a_host_and_port_is_tcp() -> None:
    assert resolve("localhost:7447", None, None, {}).endpoint == "tcp/localhost:7447"


@pytest.mark.parametrize("endpoint", ["localhost", "tcp/", "7447", "a b:1", "host:port"])
def test_what_is_no_address_is_refused(endpoint: str) -> None:
    with pytest.raises(InvalidArgument, match="is no address"):
        resolve(endpoint, None, None, {})


@pytest.mark.parametrize(("cell", "user"), [("a/b", None), (None, "*"), (None, "x" * 65), ("e od", None)])
def test_names_that_would_change_a_key_are_refused(cell: str | None, user: str | None) -> None:
    with pytest.raises(InvalidArgument, match="is no name"):
        resolve(None, cell, user, {})
