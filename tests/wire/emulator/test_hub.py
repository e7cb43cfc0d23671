"""The hub and its python-can interface over real sockets, in one process; time as given."""

import errno
import itertools
import socket
import stat
import threading
from collections.abc import Iterator
from pathlib import Path

import can
import pytest

from axisync_emulator.simcan.hub import TRANSMIT_QUEUE
from axisync_emulator.simcan.interface import SimCanBus
from axisync_emulator.simcan.listening import BusySocket, listen_at
from axisync_emulator.simcan.protocol import BUFFER_BYTES, FRAME, FRAMES_MAX, Hello
from axisync_emulator.simcan.wire import frame_bits

US = 1000
MS = 1_000_000


def test_frames_reach_the_others_when_they_are_complete(served):
    a, b, c = (served.connect() for _ in range(3))
    a.send_frame(0x123, b"\x01\x02\x03")
    took = 1000 * frame_bits(0x123, b"\x01\x02\x03")
    sent = served.now
    served.run(took - 1)
    assert b.drain() == []
    served.run(1)
    assert b.drain() == c.drain() == [(0x123, b"\x01\x02\x03", sent + took)]
    assert a.drain() == []


def test_many_frames_at_once_keep_their_order(served):
    a, b = served.connect(), served.connect()
    frames = [(0x100 + k % 7, bytes([k])) for k in range(2 * FRAMES_MAX + 1)]
    a.send_frames(frames)
    a.send_frames([])
    served.run(100 * MS)
    assert [(can_id, data) for can_id, data, _ in b.drain()] == frames


def test_frames_that_do_not_fit_are_refused_whole(served):
    a = served.connect()

    def fill() -> None:
        while True:
            a.send_frames([(0x123, bytes(8))] * FRAMES_MAX)

    with pytest.raises(can.CanOperationError) as refused:
        fill()
    assert refused.value.error_code == errno.ENOBUFS


def test_messages_of_every_kind_pass_unchanged(served):
    a, b = served.connect(), served.connect()
    messages = [
        can.Message(arbitration_id=0x7FF, is_extended_id=False, data=b""),
        can.Message(arbitration_id=0x12345678, is_extended_id=True, data=bytes(range(8))),
        can.Message(arbitration_id=0x700, is_extended_id=False, is_remote_frame=True, dlc=1),
    ]
    for message in messages:
        a.send(message)
    served.run(1_000_000)
    for message in messages:
        received = b.recv(0)
        assert received is not None
        assert received.equals(message, timestamp_delta=None, check_channel=False)
    assert b.recv(0) is None


def test_filters_and_time_stamps_are_python_cans(served):
    a, b = served.connect(), served.connect()
    b.set_filters([{"can_id": 0x200, "can_mask": 0x700}])
    a.send_frame(0x123, b"")
    a.send_frame(0x201, b"")
    served.run(1_000_000)
    received = b.recv(0)
    assert received is not None
    assert received.arbitration_id == 0x201
    assert 1.0 < received.timestamp < 1.001


def test_pending_frames_of_several_senders_by_identifier(served):
    a, b, c = (served.connect() for _ in range(3))
    for bus, can_id in ((a, 0x300), (b, 0x200), (a, 0x100), (b, 0x400)):
        bus.send_frame(can_id, b"")
    served.run(1_000_000)
    # a's second frame waits behind its first, b's first wins against that.
    assert [can_id for can_id, _, _ in c.drain()] == [0x200, 0x300, 0x100, 0x400]


def test_full_transmit_buffer_is_refused_at_once_and_recovers(served):
    a, b = served.connect(), served.connect()
    sent = itertools.count()
    with pytest.raises(can.CanOperationError) as error:
        flood(a, sent)
    assert error.value.error_code == errno.ENOBUFS
    served.run(1)
    a.send_frame(0x080, b"\x01")
    accepted = next(sent)
    assert accepted > TRANSMIT_QUEUE
    # Until they have been sent, the rest waits in the sender's socket: the hub keeps no more than a controller would.
    assert served.hub.medium.pending(served.hub.clients[0].source) <= TRANSMIT_QUEUE
    heard = 0
    for _ in range(accepted // 100 + 2):
        served.run(100 * 200 * US)
        heard += len(b.drain())
    assert heard == accepted


def flood(bus: SimCanBus, sent: Iterator[int]) -> None:
    while next(sent) < BUFFER_BYTES:
        bus.send_frame(0x123, b"\x00")


def test_slow_reader_loses_frames_and_stops_nobody(served):
    a, slow, fast = (served.connect() for _ in range(3))
    heard = 0
    for _ in range(10_000):
        a.send_frame(0x123, bytes(8))
        served.run(200 * US)
        heard += len(fast.drain())
        if served.hub.lost:
            break
    assert served.hub.lost > 0
    received = len(slow.drain())
    assert received + served.hub.lost == heard
    a.send_frame(0x080, b"\x01")
    served.run(1_000_000)
    assert [can_id for can_id, *_ in slow.drain()] == [0x080]


def test_an_overloaded_bus_is_no_silence(served):
    """A client that sends more than the bus can take: nothing of it is passed over, and no time-out fires."""
    a, b = served.connect(), served.connect()
    begin, fired = served.now, []
    count = 4 * TRANSMIT_QUEUE
    for k in range(count):
        a._sock.send(FRAME.pack(begin + k * 50 * US, 0x123, 8, bytes(8)))
    served.now += 500 * MS
    port = served.hub.attach()
    watchdog = port.timer(fired.append)
    port.listen(0x123, lambda _data, now: watchdog.set(now + 1 * MS))
    served.hub.catch_up(set(), served.now)
    served.hub.flush()
    ends = [at for _, _, at in b.drain()]
    assert len(ends) == count
    assert fired == [ends[-1] + 1 * MS]


def test_malformed_packets_are_dropped(served):
    a, b = served.connect(), served.connect()
    a._sock.send(b"nonsense")
    a._sock.send(FRAME.pack(0, 0x100, 9, bytes(8)))
    a.send_frame(0x123, b"")
    served.run(1_000_000)
    assert [can_id for can_id, *_ in b.drain()] == [0x123]
    assert served.hub.clients[0].malformed == 2


def test_stamps_of_the_future_count_as_now(served):
    a, b = served.connect(), served.connect()
    a._sock.send(FRAME.pack(1 << 63, 0x123, 0, b""))
    served.run(1_000_000)
    assert len(b.drain()) == 1


@pytest.mark.parametrize("count", [5, TRANSMIT_QUEUE + 10])
@pytest.mark.parametrize("before_reading", [False, True])
def test_a_pause_of_the_hub_changes_nothing_on_the_bus(served, count: int, before_reading: bool):
    """Frames that were sent at their times, but seen only much later, complete at their own times."""
    a, b = served.connect(), served.connect()
    begin, fired = served.now, []
    for k in range(count):
        a._sock.send(FRAME.pack(begin + 2 * k * MS, 0x080, 1, bytes([k % 240 + 1])))
    served.now += 10 * count * MS
    port = served.hub.attach()
    watchdog = port.timer(fired.append)
    port.listen(0x080, lambda _data, now: watchdog.set(now + 3 * MS))
    if before_reading:  # it had looked at the clock when the pause came
        served.hub.catch_up(set(), begin + MS)
    served.hub.catch_up(set(), served.now)
    served.hub.flush()
    ends = [at - begin - 2 * k * MS for k, (_, _, at) in enumerate(b.drain())]
    assert ends == [1000 * frame_bits(0x080, bytes([k % 240 + 1])) for k in range(count)]
    # A time-out of the drive falls after the last SYNC, not into the pause.
    assert fired == [begin + 2 * (count - 1) * MS + ends[-1] + 3 * MS]


def test_leaving_is_noticed_and_sent_frames_still_pass(served):
    a, b = served.connect(), served.connect()
    a.send_frame(0x123, b"")
    a.shutdown()
    served.run(1_000_000)
    assert len(served.hub.clients) == 1
    assert len(b.drain()) == 1


def test_the_hubs_end_is_an_error_after_the_last_frame(served):
    a, b = served.connect(), served.connect()
    a.send_frame(0x123, b"")
    served.run(1_000_000)
    served.hub.close()
    assert len(b.drain()) == 1
    with pytest.raises(can.CanOperationError):
        b.drain()
    with pytest.raises(can.CanOperationError):
        b.send_frame(0x123, b"")


def test_candump_lines(served):
    a = served.connect()
    a.send_frame(0x181, bytes.fromhex("37160a000000"))
    a.send(can.Message(arbitration_id=0x1ABCDEF, is_extended_id=True, data=b"\x01"))
    a.send(can.Message(arbitration_id=0x701, is_extended_id=False, is_remote_frame=True, dlc=0))
    served.run(10_000_000)
    served.log.flush()
    lines = (served.hub.path.parent / "dump.log").read_text().splitlines()
    end = 1000 * frame_bits(0x181, bytes.fromhex("37160a000000"))
    assert lines[0] == f"(1.{end // 1000:06d}) kingkong 181#37160A000000"
    assert [line.split(" ", 1)[1] for line in lines[1:]] == ["kingkong 01ABCDEF#01", "kingkong 701#R"]
    reader = list(can.CanutilsLogReader(served.hub.path.parent / "dump.log"))
    assert [message.arbitration_id for message in reader] == [0x181, 0x1ABCDEF, 0x701]


def test_one_hub_a_path(served):
    with pytest.raises(BusySocket):
        listen_at(served.hub.path)
    assert stat.S_ISSOCK(served.hub.path.stat().st_mode)


def test_the_socket_of_a_dead_hub_is_replaced(tmp_path: Path):
    path = tmp_path / "a.sock"
    listen_at(path).close()
    assert path.exists()
    listen_at(path).close()


def test_nobody_there_and_somebody_else(tmp_path: Path):
    with pytest.raises(can.CanInitializationError):
        SimCanBus(str(tmp_path / "none.sock"))
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as other:
        other.bind(str(tmp_path / "other.sock"))
        other.listen()

        def answer() -> None:
            peer, _ = other.accept()
            peer.send(b"220 mail.example.org ESMTP")
            peer.close()

        thread = threading.Thread(target=answer)
        thread.start()
        with pytest.raises(can.CanInitializationError, match="no simcan hub"):
            SimCanBus(str(tmp_path / "other.sock"))
        thread.join()


def test_hello_tells_the_bus(served):
    bus = served.connect()
    assert bus.bitrate == 1e6
    assert bus.time_source is None
    assert Hello.unpack(served.hub._hello).bus == "kingkong"
