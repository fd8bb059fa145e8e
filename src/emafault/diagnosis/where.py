"""Where the gap lies: how much of what the leading model adds falls on each equation, and where along it."""

from collections.abc import Mapping, Sequence

import numpy as np

BINS = 6
ALONG = ("rotor_speed", "current", "rotor_angle", "time", "direction", "temperature")
SHOWN = 12
ADJACENT = 0.6  # of an equation's signal that a stretch must hold to be told apart from the whole


def where(signals: Sequence[tuple[str, np.ndarray, Mapping]], names: Mapping[str, str]) -> list[dict]:
    """Regions by equation and coordinate with the signal that lies there.

    Parameters
    ----------
    signals : equation, (row,) what the leading model's own parameters add in units of the noise, coordinates
    names : equation of a block -> equation of the verdict

    Returns
    -------
    ``equation``, ``along``, ``from``, ``to``, ``z`` (root of the sum of squares, in units of the noise), ``share``
    """
    parts: dict[str, list[tuple[Mapping, np.ndarray]]] = {}
    for equation, signal, coordinates in signals:
        parts.setdefault(names.get(equation, equation), []).append((coordinates, signal**2))
    total = sum(float(s.sum()) for rows in parts.values() for _, s in rows)
    if total <= 0.0:
        return []
    out = []
    for equation, rows in parts.items():
        power = np.concatenate([s for _, s in rows])
        if power.sum() < 1.0:
            continue
        best: dict | None = None
        for along in ALONG:
            x = np.concatenate([c[along] for c, _ in rows])
            entry = _concentrated(equation, along, x, power, total)
            if entry is not None and (best is None or entry.pop("sharpness") > best["sharpness"]):
                sharp = _sharpness(x, power)
                best = entry | {"sharpness": sharp}
        if best is not None:
            best.pop("sharpness")
            out.append(best)
    return sorted(out, key=lambda e: -e["z"])[:SHOWN]


def _edges(x: np.ndarray) -> np.ndarray:
    return np.unique(np.quantile(x, np.linspace(0.0, 1.0, BINS + 1)))


def _sharpness(x: np.ndarray, power: np.ndarray) -> float:
    edges = _edges(x)
    if len(edges) < 3:
        return 0.0
    cell = np.clip(np.searchsorted(edges, x, "right") - 1, 0, len(edges) - 2)
    share = np.bincount(cell, power, len(edges) - 1) / power.sum()
    even = np.bincount(cell, minlength=len(edges) - 1) / len(x)
    return float(np.max(share - even))


def _concentrated(equation: str, along: str, x: np.ndarray, power: np.ndarray, total: float) -> dict | None:
    edges = _edges(x)
    if len(edges) < 2:
        return None
    cell = np.clip(np.searchsorted(edges, x, "right") - 1, 0, max(len(edges) - 2, 0))
    sums = np.bincount(cell, power, len(edges) - 1)
    first = last = int(np.argmax(sums))
    while sums[first : last + 1].sum() < ADJACENT * sums.sum():
        left = sums[first - 1] if first > 0 else -1.0
        right = sums[last + 1] if last + 1 < len(sums) else -1.0
        first, last = (first - 1, last) if left > right else (first, last + 1)
    inside = float(sums[first : last + 1].sum())
    return {
        "equation": equation, "along": along, "from": float(edges[first]), "to": float(edges[last + 1]),
        "z": float(np.sqrt(inside)), "share": inside / total, "sharpness": _sharpness(x, power),
    }  # fmt: skip
