"""Noise that is a function of time: the same at the same instant, however often one asks."""

_MASK = (1 << 64) - 1
_ODD_A, _ODD_B = 0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9


def noise(seed: int, now: int) -> float:
    """Evenly distributed in -1..1; one value for each seed and ns (a multiplicative hash)."""
    mixed = ((now ^ seed) * _ODD_A) & _MASK
    mixed = ((mixed ^ mixed >> 29) * _ODD_B) & _MASK
    return (mixed >> 43) / (1 << 20) - 1.0
