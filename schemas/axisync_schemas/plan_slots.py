"""Plan slots: a planned trajectory as the controller plays it, in shared memory.

A slot is written by the planner before front hands it over and never rewritten while it is referenced.
"""

import base64
import mmap
import struct
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from axisync_schemas.memory import PLAN_SLOT_BYTES, PLAN_SLOTS

Array = NDArray[np.float64]

_HEADER = struct.Struct("<QIIIIIIQ")  # plan_id, n axes, m segments, order, levels and points of tables, crc32, bytes
RATE_TABLES = 3
"""To rest within the stop limits, to rest within the limits of moves, and to full rate."""
CODES_PER_WORD = 4
MAX_BODY = PLAN_SLOT_BYTES - _HEADER.size


@dataclass(frozen=True, slots=True)
class Plan:
    """Piecewise polynomials over the path parameter, s at rate 1, and what the path clock needs to change its rate.

    Attributes:
        axes: [n] indices in `Cell.axes`.
        knots: [m+1] path parameter, s.
        coefficients: [m, order, n] ascending powers of (s - knots[i]); rad.
        start, end: [n] exact positions before and after.
        rate_codes: [3, levels, points] how fast the rate may change, see axisync_motion.rate_tables.
        rate_limits: [4, n] acceleration and jerk of moves, then of stops.
    """

    plan_id: int
    axes: NDArray[np.uint32]
    knots: Array
    coefficients: Array
    start: Array
    end: Array
    rate_codes: NDArray[np.uint16]
    rate_limits: Array

    @property
    def duration(self) -> float:
        """At rate 1, s."""
        return float(self.knots[-1])


def codes_as_text(codes: NDArray[np.uint16]) -> str:
    """Tables as a log or a plan file holds them: little-endian, zlib, base64."""
    return base64.b64encode(zlib.compress(codes.astype("<u2").tobytes())).decode()


def codes_of_text(text: str, levels: int, points: int) -> NDArray[np.uint16]:
    """The inverse of `codes_as_text`.

    Raises:
        PlanError: it is not of that shape.
    """
    try:
        codes = np.frombuffer(zlib.decompress(base64.b64decode(text, validate=True)), dtype="<u2")
        return codes.astype(np.uint16).reshape(RATE_TABLES, levels, points)
    except (ValueError, zlib.error) as error:
        raise PlanError(f"the path clock's tables cannot be read: {error}") from None


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
                     plan.rate_limits, _as_words(plan.rate_codes))
    )  # fmt: skip
    if len(body) > MAX_BODY:
        raise PlanTooLarge(f"a plan of {len(body)} bytes does not fit a slot of {MAX_BODY}")
    segments, order, n = plan.coefficients.shape
    view = memoryview(buffer)
    at = offset(slot)
    view[at + _HEADER.size : at + _HEADER.size + len(body)] = body
    _, levels, points = plan.rate_codes.shape
    _HEADER.pack_into(view, at, plan.plan_id, n, segments, order, levels, points, zlib.crc32(body), len(body))


def _as_words(codes: NDArray[np.uint16]) -> Array:
    """Four codes in the place of each float, the last filled up with zeros."""
    flat = np.ascontiguousarray(codes, dtype=np.uint16).ravel()
    return np.pad(flat, (0, -flat.size % CODES_PER_WORD)).view(np.float64)


class PlanReader:
    """Copies and verifies one slot in pieces, so that a large plan never makes the cycle late."""

    def __init__(self, buffer: mmap.mmap | bytearray, slot: int, plan_id: int) -> None:
        """
        Raises:
            PlanError: the slot's header is not that of plan `plan_id`.
        """
        self._view = memoryview(buffer)
        self._base = offset(slot) + _HEADER.size
        header = _HEADER.unpack_from(self._view, offset(slot))
        found, self._n, self._m, self._order, self._levels, self._points, self._crc, self._size = header
        if found != plan_id:
            raise PlanError(f"plan slot {slot} holds plan {found}, not {plan_id}")
        self._codes = RATE_TABLES * self._levels * self._points
        words = (
            self._n + (self._m + 1) + self._m * self._order * self._n + 6 * self._n + -(-self._codes // CODES_PER_WORD)
        )
        whole = self._n and self._m and self._order and self._codes
        if self._size > MAX_BODY or self._size != 8 * words or not whole:
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
        n, m, order = self._n, self._m, self._order
        cuts = np.cumsum([n, m + 1, m * order * n, n, n, 4 * n])
        axes, knots, coefficients, start, end, limits, words = np.split(values, cuts)
        if not np.isfinite(values[n : cuts[-1]]).all() or knots[0] != 0.0 or not (np.diff(knots) > 0.0).all():
            raise PlanError(f"plan {self.plan_id}: not finite, or its knots do not increase")
        return Plan(
            self.plan_id, axes.view(np.uint64).astype(np.uint32), knots, coefficients.reshape(m, order, n), start, end,
            words.view(np.uint16)[: self._codes].reshape(RATE_TABLES, self._levels, self._points), limits.reshape(4, n),
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
