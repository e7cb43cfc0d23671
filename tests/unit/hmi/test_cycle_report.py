"""What `/cycle` says of the last second: percentiles by stage, late ticks by cause."""

from axisync_schemas.cell import parse_cell
from axisync_schemas.enumerations import LateCause
from axisync_schemas.memory import Control, TimingRing, Word
from axisync_service.hmi.reports import cycle_report
from support.cells import eod_text

CELL = parse_cell(eod_text())


def test_of_the_last_second_only() -> None:
    control, ring = Control(bytearray(Control.size(2)), 2), TimingRing(bytearray(TimingRing.size()))
    assert cycle_report(CELL, control, ring, 1) is None
    for tick in range(1, 1001):
        late = tick % 100 == 0
        cause = LateCause.BUS if tick == 900 else LateCause.SCHEDULER if late else LateCause.NONE
        ring.write(tick, 500_000 if late else 2_000, 1_000, 2_000, 3_000, 4_000, int(tick == 800), cause)
    control[Word.CONTROLLER_TICK] = 1000
    report = cycle_report(CELL, control, ring, 2)
    assert report is not None
    assert (report.late_ticks, report.skipped_ticks) == (5, 1)
    assert report.late_by == {"scheduler": 4, "own_code": 0, "bus": 1}
    assert report.record_us is not None
    assert (report.read_us.p50, report.record_us.max) == (1.0, 4.0)
    assert (report.lateness_us.p50, report.lateness_us.max) == (2.0, 500.0)
