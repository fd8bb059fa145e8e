"""A wave of a fixed frequency, its phase another in each recording."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..left import Found, Left, Shape, gain
from ..model import Block
from .spectrum import above, refined

AXIS = "phase of the wave (rad)"  # of its picture
ALONG = "time"
EACH = True
POSITIVE = ("frequency",)
ENDS: tuple[str, ...] = ()
CHANNELS: tuple[str, ...] = ("current", "voltage", "angle", "output")  # of the measuring chain that may have it
COEFFICIENTS = ("cosine", "sine")
PERIODS = 3.0  # fewest in a recording
AROUND = 30.0  # lines whose level a line stands out of
HIGHEST = 0.45  # of the sampling rate


def columns(coordinates: Mapping, shape: Shape) -> np.ndarray:
    """(2, row) cosine and sine."""
    x = 2.0 * np.pi * shape["frequency"] * np.asarray(coordinates["time"])
    return np.array([np.cos(x), np.sin(x)])


def coarse(left: Left, driver: int) -> tuple[Shape, float] | None:
    """The frequency of the highest line of the recordings' spectra together."""
    step = _step(left)
    size = 1 << int(np.ceil(np.log2(2.0 * left.longest / step + 2)))
    frequencies = np.fft.rfftfreq(size, step)
    total = np.zeros(len(frequencies))
    for b, w in zip(left.blocks, left.remaining, strict=True):
        t = np.asarray(b.coordinates["time"])
        cells = np.bincount(((t - t[0]) / step).astype(int), w * b.coordinates["drivers"][driver], size)[:size]
        ratio = above(np.abs(np.fft.rfft(cells)) ** 2, 2 * int(AROUND * size * step / (t[-1] - t[0])) + 1)
        highest = b.coordinates.get("highest_frequency", HIGHEST / np.median(np.diff(t)))
        known = (frequencies > PERIODS / (t[-1] - t[0])) & (frequencies < highest)
        total += np.where(known, ratio, 0.0)
    highest_line = float(frequencies[int(np.argmax(total))])
    return {"frequency": highest_line}, _values(left, driver, [highest_line])[0]


def _step(left: Left) -> float:
    return min(float(np.median(np.diff(b.coordinates["time"]))) for b in left.blocks)


def _values(left: Left, driver: int, frequencies: Sequence[float]) -> list[float]:
    """What a wave of each of several frequencies explains."""

    def of(b: Block) -> np.ndarray:
        return np.concatenate([columns(b.coordinates, {"frequency": f}) for f in frequencies])

    out = np.zeros(len(frequencies))
    for g, G in left.each(of, driver):
        out += [gain(g[k : k + 2], G[k : k + 2, k : k + 2]) for k in range(0, len(g), 2)]
    return out.tolist()


def fine(left: Left, driver: int, shape: Shape) -> list[Found]:
    """The frequency."""
    f, deviation = refined(shape["frequency"], 0.5 / left.longest, lambda x: _values(left, driver, x))
    (value,) = _values(left, driver, [f])
    return [Found((("frequency", f, deviation, "Hz"),), value, max(1.0, left.longest * HIGHEST / _step(left)))]


def told(values: np.ndarray, shape: Shape) -> dict[str, float]:
    """Amplitude: root mean square over the recordings of what each has."""
    pairs = np.asarray(values).reshape(-1, 2)
    return {"amplitude": float(np.sqrt(np.mean(np.sum(pairs**2, axis=1))))}


def position(coordinates: Mapping, shape: Shape, values: np.ndarray) -> np.ndarray:
    """(row,) where rows lie along the wave."""
    x = 2.0 * np.pi * shape["frequency"] * np.asarray(coordinates["time"])
    return np.mod(x - np.arctan2(values[1], values[0]), 2.0 * np.pi)
