import json

import pytest

from axisync_client import InvalidArgument, Unavailable, UnexpectedReply
from axisync_client.discovery import check_versions, the_cell


def test_the_only_cell() -> None:
    assert the_cell(["axisync/eod/info"], "tcp/x:1") == "eod"


def test_none() -> None:
    with pytest.raises(Unavailable, match="no axisync cell answers at tcp/x:1"):
        the_cell(["other/eod/info"], "tcp/x:1")


def test_several_are_named() -> None:
    with pytest.raises(InvalidArgument, match=r"lab, west.*AXISYNC_CELL"):
        the_cell(["axisync/west/info", "axisync/lab/info"], "tcp/x:1")


def test_a_daemon_of_a_later_version_that_still_serves_ours() -> None:
    check_versions(json.dumps({"version": "3.0", "schema_versions": [1, 2], "new_field": 1}).encode())


def test_a_daemon_of_another_version_is_named_with_both() -> None:
    with pytest.raises(UnexpectedReply, match=r"axisync 3\.0\) serves schema 2, 3, this client .* speaks schema 1"):
        check_versions(json.dumps({"version": "3.0", "schema_versions": [2, 3]}).encode())


@pytest.mark.parametrize("info", [b"", b"{}", b"[]", b'{"version": "1", "schema_versions": 1}'])
def test_something_else(info: bytes) -> None:
    with pytest.raises(UnexpectedReply, match="no axisync daemon"):
        check_versions(info)
