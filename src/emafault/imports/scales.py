"""Factors told from ratios: decades of probes, and units of angles and speeds."""

from collections.abc import Mapping, Sequence

import numpy as np

from .finding import Finding

CLOSEST = 0.01  # of a factor, below which a ratio's distance from it is the machine's and the sensors' own
DECADES = {10.0**k: f"{10.0**k:g} times" for k in range(-3, 4)}


def nearest(what: str, ratio: float, factors: Mapping[float, str]) -> tuple[float, Finding]:
    """The factor that a ratio is nearest to, by its logarithm; the margin is that of the distances.

    Parameters
    ----------
    ratio : of what is to what should be, positive
    factors : factor -> in words
    """
    far = {f: max(abs(np.log(max(ratio, 1e-12) / f)), CLOSEST) for f in factors}
    first, second = sorted(far, key=lambda f: far[f])[:2]
    return first, Finding(what, factors[first], far[second] / far[first], factors[second], first != 1.0)


def sum_test(currents: Sequence[np.ndarray]) -> tuple[np.ndarray, Finding]:
    """Signs and decades of three currents, which add up to zero: what each is to be multiplied by, most of them by 1.

    Parameters
    ----------
    currents : (sample, 3) of every recording

    Returns
    -------
    (3,) factors, and the finding
    """
    gram = np.sum([i.T @ i for i in currents], axis=0)
    signed = [s * 10.0**k for k in range(-2, 3) for s in (1, -1)]
    tried = {(1.0, b, c): _unbalance(gram, np.array([1.0, b, c])) for b in signed for c in signed}
    first, second = sorted(tried, key=lambda f: tried[f])[:2]
    margin = tried[second] / max(tried[first], 1e-12)
    taken = _mostly_one(first)
    other, changed = _words(_mostly_one(second)), taken != (1.0, 1.0, 1.0)
    return np.array(taken), Finding("currents that add up to zero", _words(taken), margin, other, changed)


def _unbalance(gram: np.ndarray, factors: np.ndarray) -> float:
    return float(factors @ gram @ factors / np.sum(factors**2 * np.diag(gram)))


def _mostly_one(factors: tuple[float, ...]) -> tuple[float, ...]:
    """The same factors relative to that which most of them share."""
    usual = max(factors, key=lambda f: (factors.count(f), -factors.index(f)))
    return tuple(f / usual for f in factors)


def _words(factors: tuple[float, ...]) -> str:
    changed = [f"{phase} times {f:g}" for phase, f in zip("abc", factors) if f != 1.0]
    return ", ".join(changed) or "as they are"
