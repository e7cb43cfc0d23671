"""SYNC counting and which SYNC triggers which TPDO."""

import pytest
from canopen import SdoAbortedError

from axisync_emulator.drive.object_dictionary import Objects
from axisync_emulator.drive.pdo import Rpdo, Tpdo
from axisync_emulator.drive.sync import SyncConsumer

NODE = 3


def counters(first: int, count: int, overflow: int = 240) -> list[int]:
    return [(first - 1 + i) % overflow + 1 for i in range(count)]


def test_each_counter_is_the_next():
    sync = SyncConsumer()
    sync.overflow = 240
    assert [sync.receive(bytes([c]), 0) for c in counters(7, 500)] == [1] * 500


@pytest.mark.parametrize(("last", "counter", "advance"), [(5, 6, 1), (5, 8, 3), (239, 2, 3), (240, 1, 1), (5, 5, 0)])
def test_gaps_and_repetitions(last: int, counter: int, advance: int):
    sync = SyncConsumer()
    sync.overflow = 240
    sync.receive(bytes([last]), 0)
    assert sync.receive(bytes([counter]), 1) == advance


@pytest.mark.parametrize("data", [b"", b"\x00", b"\xf1", b"\x01\x02"])
def test_without_a_proper_counter(data: bytes):
    sync = SyncConsumer()
    sync.overflow = 240
    assert sync.receive(data, 0) == -1


def test_without_overflow_every_sync_counts():
    sync = SyncConsumer()
    assert [sync.receive(data, 0) for data in (b"", b"\x05", b"\x05")] == [1, 1, 1]


def tpdo(kind: int, start: int) -> Tpdo:
    objects = Objects(NODE, {})
    pdo = Tpdo(objects, 0x1801)
    objects.put(0x1801, 1, 0x280 + NODE)
    objects.put(0x1801, 2, kind)
    objects.put(0x1801, 6, start)
    pdo.configure()
    return pdo


def sent(pdo: Tpdo, received: list[int]) -> list[int]:
    """Counters at which it is sent, where these SYNCs arrive."""
    before, out = received[0] - 1, []
    for counter in received:
        if pdo.due((counter - before) % 240, counter):
            out.append(counter)
        before = counter
    return out


def test_every_sixth_from_its_start_value():
    assert sent(tpdo(6, 4), counters(1, 30)) == [4, 10, 16, 22, 28]


def test_start_value_waits_for_the_counter_to_come_round():
    assert sent(tpdo(6, 4), counters(100, 160))[:3] == [4, 10, 16]


def test_lost_syncs_do_not_shift_the_grid():
    assert sent(tpdo(6, 4), [1, 2, 3, 4, 5, 11, 12, 15, 16, 17, 22]) == [4, 11, 16, 22]


def test_lost_start_is_made_up_for():
    assert sent(tpdo(6, 4), [1, 2, 5, 6, 9, 10, 11]) == [5, 11]


def test_every_sync_from_the_first():
    assert sent(tpdo(1, 0), counters(200, 5)) == counters(200, 5)


def write(objects: Objects, index: int, sub: int, value: int) -> None:
    objects.set_data(index, sub, objects.variable(index, sub).encode_raw(value), check_writable=True)


def refused(objects: Objects, index: int, sub: int, value: int) -> int:
    before = objects.get_data(index, sub)
    with pytest.raises(SdoAbortedError) as error:
        write(objects, index, sub, value)
    assert objects.get_data(index, sub) == before
    return error.value.code


def test_mapping_changes_only_in_the_proper_order():
    objects = Objects(NODE, {})
    rpdo = Rpdo(objects, 0x1400)
    assert refused(objects, 0x1600, 0, 0) == 0x08000022  # PDO is valid
    write(objects, 0x1400, 1, 0x80000200 + NODE)
    assert refused(objects, 0x1600, 2, 0x60FE0120) == 0x08000022  # count is not 0
    write(objects, 0x1600, 0, 0)
    write(objects, 0x1600, 2, 0x60FE0120)
    write(objects, 0x1600, 0, 2)
    write(objects, 0x1400, 1, 0x321)
    rpdo.configure()
    assert (rpdo.cob_id, rpdo.keys, rpdo.struct.size) == (0x321, ((0x6040, 0), (0x60FE, 1)), 6)


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        (0x12340010, 0x06020000),  # no such object
        (0x60FE0720, 0x06090011),  # no such sub-index
        (0x60410010, 0x06040041),  # read-only, for an RPDO
        (0x60850020, 0x06040041),  # not mappable
        (0x60400020, 0x06040041),  # wrong length
    ],
)
def test_what_cannot_be_mapped(entry: int, code: int):
    objects = Objects(NODE, {})
    Rpdo(objects, 0x1400)
    write(objects, 0x1400, 1, 0x80000200 + NODE)
    write(objects, 0x1600, 0, 0)
    assert refused(objects, 0x1600, 1, entry) == code


def test_more_than_eight_bytes_cannot_be_mapped():
    objects = Objects(NODE, {})
    Rpdo(objects, 0x1400)
    write(objects, 0x1400, 1, 0x80000200 + NODE)
    write(objects, 0x1600, 0, 0)
    for sub in (1, 2, 3):
        write(objects, 0x1600, sub, 0x607A0020)
    assert refused(objects, 0x1600, 0, 3) == 0x06040042
    write(objects, 0x1600, 0, 2)


@pytest.mark.parametrize("cob_id", [0x000, 0x07F, 0x101, 0x580 + NODE, 0x600 + NODE, 0x700 + NODE, 0x2000_0181])
def test_restricted_identifiers(cob_id: int):
    objects = Objects(NODE, {})
    Tpdo(objects, 0x1800)
    write(objects, 0x1800, 1, 0x80000180 + NODE)
    assert refused(objects, 0x1800, 1, cob_id) == 0x06090030


def test_a_valid_pdo_keeps_its_identifier():
    objects = Objects(NODE, {})
    Tpdo(objects, 0x1800)
    assert refused(objects, 0x1800, 1, 0x1C0) == 0x08000022
    assert refused(objects, 0x1800, 2, 254) == 0x06090030
    assert refused(objects, 0x1800, 6, 3) == 0x08000022
