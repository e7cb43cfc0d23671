"""The SDO client against frames written out by hand (CiA 301, 7.2.4.3)."""

import pytest

from axisync_service.canopen.sdo import SdoClient, SdoError


def exchange(client: SdoClient, *pairs: tuple[str, str]) -> None:
    """Expects the client to send the first of each pair, and answers with the second."""
    for request, response in pairs:
        frame = client.poll(0)
        assert frame is not None
        assert frame.hex() == request
        client.receive(bytes.fromhex(response))


def test_expedited_upload() -> None:
    client = SdoClient()
    client.upload(0x1018, 1)
    exchange(client, ("4018100100000000", "4318100178563412"))
    assert client.idle
    assert client.result == bytes.fromhex("78563412")


@pytest.mark.parametrize(("data", "request_frame"), [(b"\x08", "2f60600008000000"), (b"\x01\x02", "2b60600001020000"),
                                                     (b"\x01\x02\x03\x04", "2360600001020304")])  # fmt: skip
def test_expedited_download(data: bytes, request_frame: str) -> None:
    client = SdoClient()
    client.download(0x6060, 0, data)
    exchange(client, (request_frame, "6060600000000000"))
    assert client.result == b""


def test_segmented_upload() -> None:
    client = SdoClient()
    client.upload(0x1008, 0)
    exchange(
        client,
        ("4008100000000000", "410810000a000000"),
        ("6000000000000000", "0061786973796e63"),
        ("7000000000000000", "1964727600000000"),
    )
    assert client.result == b"axisyncdrv"[:7] + b"drv"


def test_segmented_download() -> None:
    client = SdoClient()
    client.download(0x1008, 0, b"ninebytes")
    exchange(
        client,
        ("2108100009000000", "6008100000000000"),
        ("006e696e65627974", "2000000000000000"),
        ("1b65730000000000", "3000000000000000"),
    )
    assert client.result == b""


def test_abort_in_words() -> None:
    client = SdoClient()
    client.upload(0x2345, 6)
    exchange(client, ("4045230600000000", "8045230600000206"))
    assert isinstance(client.result, SdoError)
    assert client.result.abort == 0x06020000
    assert "object does not exist" in str(client.result)


def test_time_out_aborts_the_transfer() -> None:
    client = SdoClient(timeout_ns=1000)
    client.upload(0x1000, 0)
    client.poll(0)
    assert client.poll(1000) is None
    frame = client.poll(1001)
    assert frame is not None
    assert frame.hex() == "8000100000000405"
    assert isinstance(client.result, SdoError)


def test_foreign_and_stale_answers_are_ignored() -> None:
    client = SdoClient()
    client.receive(bytes.fromhex("4318100178563412"))
    client.upload(0x1018, 1)
    client.poll(0)
    client.receive(bytes.fromhex("4318100278563412"))
    client.receive(b"short")
    client.receive(bytes.fromhex("8018100200000206"))
    assert not client.idle
    client.receive(bytes.fromhex("4b18100178560000"))
    assert client.result == bytes.fromhex("7856")


def test_answers_that_nobody_asked_for_change_nothing_and_are_counted() -> None:
    client = SdoClient()
    answer = bytes.fromhex("4318100178563412")
    client.receive(answer)
    client.upload(0x1018, 1)
    client.receive(answer)  # the request is not on the bus yet
    assert client.poll(0) is not None
    client.receive(bytes.fromhex("4300100092010000"))
    assert (client.idle, client.unasked) == (False, 3)
    client.receive(answer)
    assert (client.idle, client.unasked) == (True, 3)
    client.receive(answer)
    assert client.unasked == 4
