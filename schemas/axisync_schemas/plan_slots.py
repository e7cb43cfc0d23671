"""Plan slots: a planned trajectory as the controller plays it, in shared memory.

A slot is written by the planner before front hands it over and never rewritten while it is referenced.
"""

import mmap
import struct
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.memory import PLAN_SLOT_BYTES, PLAN_SLOTS

Array = NDArray[np.float64]

_HEADER = struct.Struct("<QIIIIIQ")  # plan_id, n axes, m segments, order, k stop-table cells, crc32, bytes of body
MAX_BODY = PLAN_SLOT_BYTES - _HEADER.size


@dataclass(frozen=True, slots=True)
class Plan:
    """Piecewise polynomials over the path parameter, s at rate 1, and what a stop needs.

    Attributes:
        axes: [n] indices in `Cell.axes`.
        knots: [m+1] path parameter, s.
        coefficients: [m, order, n] ascending powers of (s - knots[i]); rad.
        start, end: [n] exact positions before and after.
        stop_s, stop_duration: [k] cells of the stop table: begin of the cell, s, and how long a stop takes from there.
    """

    plan_id: int
    axes: NDArray[np.uint32]
    knots: Array
    coefficients: Array
    start: Array
    end: Array
    stop_s: Array
    stop_duration: Array

    @property
    def duration(self) -> float:
        """At rate 1, s."""
        return float(self.knots[-1])


class PlanError(ValueError):
    """A slot that does not hold the whole plan it should."""


class PlanTooLarge(PlanError):
    """A plan that no slot can hold."""


def offset(slot: int) -> int:
    """Where a slot begins in the region.

    Raises:
        PlanError: no such slot.
    """
    if not 0 <= slot < PLAN_SLOTS:
        raise PlanError(f"plan slot {slot} is not one of 0..{PLAN_SLOTS - 1}")
    return slot * PLAN_SLOT_BYTES


def write_plan(buffer: mmap.mmap | bytearray, slot: int, plan: Plan) -> None:
    """Writes a plan, header last.

    Raises:
        PlanTooLarge: the plan is larger than a slot.
    """
    body = b"".join(
        np.ascontiguousarray(part).tobytes()
        for part in (plan.axes.astype(np.uint64), plan.knots, plan.coefficients, plan.start, plan.end,
                     plan.stop_s, plan.stop_duration)
    )  # fmt: skip
    if len(body) > MAX_BODY:
        raise PlanTooLarge(f"a plan of {len(body)} bytes does not fit a slot of {MAX_BODY}")
    segments, order, n = plan.coefficients.shape
    view = memoryview(buffer)
    at = offset(slot)
    view[at + _HEADER.size : at + _HEADER.size + len(body)] = body
    _HEADER.pack_into(view, at, plan.plan_id, n, segments, order, len(plan.stop_s), zlib.crc32(body), len(body))


class PlanReader:
    """Copies and verifies one slot in pieces, so that a large plan never makes the cycle late."""

    def __init__(self, buffer: mmap.mmap | bytearray, slot: int, plan_id: int) -> None:
        """
        Raises:
            PlanError: the slot's header is not that of plan `plan_id`.
        """
        self._view = memoryview(buffer)
        self._base = offset(slot) + _HEADER.size
        found, self._n, self._m, self._order, self._k, self._crc, self._size = _HEADER.unpack_from(
            self._view, offset(slot)
        )
        if found != plan_id:
            raise PlanError(f"plan slot {slot} holds plan {found}, not {plan_id}")
        words = self._n + (self._m + 1) + self._m * self._order * self._n + 2 * self._n + 2 * self._k
        if self._size > MAX_BODY or self._size != 8 * words or not (self._n and self._m and self._order and self._k):
            raise PlanError(f"plan slot {slot}: its header is damaged")
        self.plan_id = plan_id
        self._body = bytearray(self._size)
        self._done = 0
        self._running_crc = 0

    def advance(self, limit: int = 64 * 1024) -> bool:
        """Copies up to `limit` bytes; True when all is there."""
        end = min(self._size, self._done + limit)
        piece = self._view[self._base + self._done : self._base + end]
        self._body[self._done : end] = piece
        self._running_crc = zlib.crc32(self._body[self._done : end], self._running_crc)
        self._done = end
        return bool(end == self._size)

    def plan(self) -> Plan:
        """The verified plan.

        Raises:
            PlanError: checksum wrong, numbers not finite, or knots not increasing.
        """
        if self._done != self._size or self._running_crc != self._crc:
            raise PlanError(f"plan {self.plan_id}: checksum wrong")
        values = np.frombuffer(self._body, dtype=np.float64)
        n, m, order, k = self._n, self._m, self._order, self._k
        cuts = np.cumsum([n, m + 1, m * order * n, n, n, k])
        axes, knots, coefficients, start, end, stop_s, stop_duration = np.split(values, cuts)
        if not np.isfinite(values[n:]).all() or knots[0] != 0.0 or not (np.diff(knots) > 0.0).all():
            raise PlanError(f"plan {self.plan_id}: not finite, or its knots do not increase")
        return Plan(
            self.plan_id, axes.view(np.uint64).astype(np.uint32), knots, coefficients.reshape(m, order, n), start, end,
            stop_s, stop_duration,
        )  # fmt: skip


def read_plan(buffer: mmap.mmap | bytearray, slot: int, plan_id: int) -> Plan:
    """The whole plan at once, for readers that may take their time.

    Raises:
        PlanError: the slot does not hold this plan, whole.
    """
    reader = PlanReader(buffer, slot, plan_id)
    while not reader.advance():
        pass
    return reader.plan()
