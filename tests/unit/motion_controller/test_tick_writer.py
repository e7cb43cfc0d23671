"""What a tick writer puts into the ring: the setpoints, their derivatives cut as records have them."""

import numpy as np

from axisync_schemas.tick_ring import TickRing
from axisync_schemas.ticks import Records, TickLayout, shorten_rates
from axisync_service.motion_controller.reporter import TickWriter
from support.decided_log import Decided
from support.saved_log import cell

SLOTS = 16


def test_the_record_is_the_setpoint_but_for_digits_that_nobody_needs() -> None:
    bench = Decided()
    layout = TickLayout(len(cell().axes), len(cell().groups))
    ring = TickRing(bytearray(SLOTS * (layout.size + 64)), layout, SLOTS)
    writer, rng, now = TickWriter(ring), np.random.default_rng(5), bench.core.current
    for tick in (1, 2):
        wanted = layout.new()
        for name in ("position", "velocity", "acceleration", "jerk"):
            getattr(now, name)[:] = wanted[name] = rng.normal(size=layout.n_axes)
        shorten_rates(wanted)
        writer.write(tick, 7_000, 40, False, now, bench.core)
        data = ring.read(tick)
        assert data is not None
        record: Records = layout.decode(data)[0]
        assert (int(record["tick"]), int(record["cycle_start_ns"]), int(record["lateness_ns"])) == (tick, 7_000, 40)
        for name in ("position", "velocity", "acceleration", "jerk"):
            assert record[name].tolist() == wanted[name].tolist()
