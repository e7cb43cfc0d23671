"""Lissajous curves by their arc length.

The speed by u is resolved by Chebyshev polynomials on panels that get narrower towards sharp bends; their integral is
the arc length, and on each panel its inverse, u by length, is again a polynomial. Neighbours meet to rounding in value
and in the derivatives that planning judges, and evaluation needs no iteration. Angles are taken from the middle of
their panel, so that the rounding of u does not show in a bend much narrower than the curve.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from axisync_robot.paths_curves import LENGTH_MIN, checked
from axisync_robot.paths_errors import Cusp, ZeroCurve
from axisync_schemas.moves import MAX_TURNS

Array = NDArray[np.float64]

CUSP_SPEED = 1e-3
"""Of the highest speed by u: below, the curve turns back within a millionth of its size, which no arm can follow."""

_DEGREE = 14
_NODES = np.cos(np.pi * np.arange(_DEGREE, -1, -1) / _DEGREE)
"""Both ends of a panel are among them, so that neighbours meet."""
_FIT = np.linalg.inv(chebyshev.chebvander(_NODES, _DEGREE))
_RESOLVED = 1e-14
"""Of the last coefficients, relative to the panel; ten times the rounding of the fit."""
_WIDTH_MIN = 2.0**-20
"""Of a period; a hundred times narrower than the sharpest bend needs."""
_NEWTON_STEPS = 6


@dataclass(frozen=True, slots=True, eq=False)
class _Form:
    """amplitude (sin(rate u + phase) - sin(phase)), each [3]."""

    amplitude: Array
    rate: Array
    phase: Array

    @property
    def periods(self) -> float:
        """Of the fastest coordinate."""
        return float(np.abs(self.rate).max()) / math.tau

    def offsets(self, u: Array) -> Array:
        """From the start, [k, 3], at u [k]; as a product, which keeps its digits near the start."""
        half = 0.5 * u[:, None] * self.rate
        offsets: Array = 2.0 * self.amplitude * np.cos(half + self.phase) * np.sin(half)
        return offsets

    def speed(self, u: Array, near: Array) -> Array:
        """By u, [m, n], at `near` [m, n] from u [n]."""
        at, by = u[:, None] * self.rate + self.phase, near[..., None] * self.rate
        velocity = self.amplitude * self.rate * (np.cos(at) * np.cos(by) - np.sin(at) * np.sin(by))
        speed: Array = np.sqrt((velocity * velocity).sum(axis=-1))
        return speed


@dataclass(frozen=True, slots=True, eq=False)
class LissajousCurve:
    """By arc length. Attributes: `start`, `end` [3], m; of panel j, of n:

    `knots` [n + 1] (m, where it begins), `half` [n] (of its u), `inverse` [15, n] (Chebyshev coefficients of its u from
    -1 to 1 by its length from -1 to 1), `middle` [n, 9] (offset of its middle from the start, and twice the amplitude
    times cosine and sine there).
    """

    start: Array
    end: Array
    rate: Array
    knots: Array
    half: Array
    inverse: Array
    middle: Array

    @property
    def length(self) -> float:
        """m."""
        return float(self.knots[-1])

    def at(self, lengths: Array) -> Array:
        """As `Curve.at`."""
        panel = np.searchsorted(self.knots[1:-1], lengths, side="right")
        low, high = self.knots[panel], self.knots[panel + 1]
        local = ((lengths - low) - (high - lengths)) / (high - low)
        u = self.half[panel] * chebyshev.chebval(local, self.inverse.take(panel, axis=1), tensor=False)
        # sin(a + b) - sin(a) = 2 sin(b / 2) cos(a + b / 2)
        half = (0.5 * u)[:, None] * self.rate
        sine, middle = np.sin(half), self.middle.take(panel, axis=0)
        offsets = middle[:, :3] + sine * (middle[:, 3:6] * np.cos(half) - middle[:, 6:] * sine)
        positions: Array = self.start + offsets
        return positions


def lissajous_from(start: Array, amplitude: Array, frequency: Array, phase: Array) -> LissajousCurve:
    """p(u) = start + amplitude (sin(2 pi frequency u + phase) - sin(phase)), u from 0 to 1; each [3], m, 1, rad.

    Raises:
        ZeroCurve, Cusp
        OutOfRange: also more than 100 periods.
    """
    checked(amplitude, "amplitude")
    checked(frequency, "frequency", MAX_TURNS, "periods")
    form = _Form(amplitude, math.tau * frequency, np.array([math.remainder(x, math.tau) for x in phase]))
    _refuse_cusp(form)
    (low, high), lengths, inverse = _panels(form)
    # Whole periods end exactly where they began.
    rest = _Form(amplitude, math.tau * np.array([math.remainder(x, 1.0) for x in frequency]), form.phase)
    middle = 0.5 * (low + high)
    angle, twice = middle[:, None] * form.rate + form.phase, 2.0 * amplitude
    return LissajousCurve(
        start=start,
        end=start + rest.offsets(np.ones(1))[0],
        rate=form.rate,
        knots=np.concatenate([[0.0], np.cumsum(lengths)]),
        half=0.5 * (high - low),
        inverse=inverse,
        middle=np.hstack([form.offsets(middle), twice * np.cos(angle), twice * np.sin(angle)]),
    )


def _refuse_cusp(form: _Form) -> None:
    u = np.linspace(0.0, 1.0, 64 * (1 + math.ceil(form.periods)) + 1)
    speed = form.speed(u, np.zeros_like(u))
    highest = float(speed.max())
    if highest < LENGTH_MIN:
        raise ZeroCurve(highest, LENGTH_MIN, "Lissajous curve")
    at, lowest = _slowest(form, u, speed)
    if lowest < CUSP_SPEED * highest:
        raise Cusp(lowest / highest, CUSP_SPEED, at)


def _slowest(form: _Form, u: Array, speed: Array) -> tuple[float, float]:
    """Where the speed is lowest, and the speed there; by samples u, speed [k].

    Newton on the derivative of its square, from each local minimum of the samples.
    """
    padded = np.concatenate([[np.inf], speed, [np.inf]])
    around = u[(speed <= padded[:-2]) & (speed <= padded[2:])]
    best = around
    weight = (form.amplitude * form.rate) ** 2 * form.rate
    for _ in range(_NEWTON_STEPS):
        twice = 2.0 * (best[:, None] * form.rate + form.phase)
        slope, bend = -np.sin(twice) @ weight, -2.0 * np.cos(twice) @ (weight * form.rate)
        step = np.divide(slope, bend, out=np.zeros_like(slope), where=bend > 0.0)
        best = np.clip(best - step, np.maximum(around - u[1], 0.0), np.minimum(around + u[1], 1.0))
    candidates = np.concatenate([best, around])
    speeds = form.speed(candidates, np.zeros_like(candidates))
    return float(candidates[speeds.argmin()]), float(speeds.min())


def _panels(form: _Form) -> tuple[Array, Array, Array]:
    """Panels [2, n] of u in order, their lengths [n] in m and the coefficients of their inverse [15, n]."""
    # By powers of two, so that middles and halves are exact.
    edges = np.linspace(0.0, 1.0, 1 + 2 ** math.ceil(math.log2(4.0 * max(1.0, form.periods))))
    panels, done = np.stack([edges[:-1], edges[1:]]), []
    width_min = _WIDTH_MIN / max(1.0, form.periods)
    while panels.size:
        speed = _FIT @ form.speed(0.5 * panels.sum(axis=0), _half(panels) * _NODES[:, None])
        rough = _rough(speed / speed[0], panels, width_min)
        if rough.any():
            panels = np.hstack([panels[:, ~rough], _split(panels[:, rough])])
            continue
        lengths, inverse = _inverted(speed * _half(panels))
        rough = _rough(inverse, panels, width_min)
        done.append((panels[:, ~rough], lengths[~rough], inverse[:, ~rough]))
        panels = _split(panels[:, rough])
    found, lengths, inverse = (np.concatenate(part, axis=-1) for part in zip(*done, strict=True))
    order = np.argsort(found[0])
    return found[:, order], lengths[order], inverse[:, order]


def _half(panels: Array) -> Array:
    half: Array = 0.5 * (panels[1] - panels[0])
    return half


def _split(panels: Array) -> Array:
    middle = 0.5 * panels.sum(axis=0)
    return np.hstack([np.stack([panels[0], middle]), np.stack([middle, panels[1]])])


def _rough(coefficients: Array, panels: Array, width_min: float) -> NDArray[np.bool_]:
    """Of which panels [n] the polynomial [15, n] says too little, as its last coefficients tell."""
    tails = np.abs(coefficients[-2:]).max(axis=0)
    rough: NDArray[np.bool_] = (tails > _RESOLVED) & (panels[1] - panels[0] > width_min)
    return rough


def _inverted(rate: Array) -> tuple[Array, Array]:
    """Of coefficients [15, n] of length by x from -1 to 1: whole lengths [n], and of x by length [15, n] (Newton)."""
    arc = chebyshev.chebint(rate, lbnd=-1)
    lengths: Array = np.asarray(chebyshev.chebval(np.ones(rate.shape[1]), arc, tensor=False))
    wanted = lengths * (0.5 * (1.0 + _NODES))[:, None]
    x = np.repeat(_NODES[:, None], rate.shape[1], axis=1)
    for _ in range(_NEWTON_STEPS):
        off = chebyshev.chebval(x, arc, tensor=False) - wanted
        x = np.clip(x - off / chebyshev.chebval(x, rate, tensor=False), -1.0, 1.0)
    x[0], x[-1] = -1.0, 1.0
    return lengths, _FIT @ x
