"""Maps and slow moves of a motor: mean current in bins of the rotor's angle, with its poles and slots."""

import hashlib
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from ...errors import InputError
from ..files import read_arrays, require_finite
from ..statement import Arrays, Distortion, Rows
from ..statistics import mean_variance, smooth_error

BINS = 128  # of one turn
ORDERS = 63  # highest wave per turn that the bins resolve
COUNTS = 8192  # encoder counts of one turn
ACCURACY = 0.02  # of the current's rms: friction of the held rotor and position of the samples
STANDS_OUT = 12.0  # score (log power over noise, less its cost) from which a spectrum tells poles and slots
CREEP = 0.05  # rad/s over which friction turns with the speed
SETTLE = 0.5  # s at the start of a move


def read(path: Path) -> dict[str, Arrays]:
    """Maps (8192,) over the encoder counts, 0 = not visited, or moves (3, n) of time, position, current.

    Raises
    ------
    InputError
        when an array is neither, visits too little of the turn, or is not finite.
    """
    arrays = read_arrays(path)
    if not arrays:
        raise InputError(f"{path}: holds no array")
    for name, values in arrays.items():
        if values.shape != (COUNTS,) and not (values.ndim == 2 and values.shape[0] == 3 and values.shape[1] >= 500):
            raise InputError(
                f"{path}: {name!r} has shape {values.shape}; a map is ({COUNTS},), a move (3, n) with n >= 500"
            )
        require_finite(path, {name: np.atleast_2d(values).T}, (name,), rows=1)
        theta = _samples(values)["theta"]
        seen = np.unique((theta % (2 * np.pi) / (2 * np.pi) * BINS).astype(int)).size
        if seen < 0.8 * BINS:
            raise InputError(f"{path}: {name!r} visits {seen / BINS:.0%} of the turn, at least 80 % are needed")
    return {Path(path).name.split(".")[0]: arrays}


def _samples(values: np.ndarray) -> Arrays:
    """Angle (rad), current (A), speed (rad/s) and acceleration (rad/s2) of the samples of a map or a move."""
    if values.ndim == 1:
        visited = np.flatnonzero(values)
        zero = np.zeros(visited.size)
        return {"theta": 2 * np.pi * visited / COUNTS, "i": values[visited], "v": zero, "a": zero, "s": zero}
    time, position, current = values
    theta = np.unwrap(2 * np.pi * position / COUNTS)
    step = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1], step)
    even = np.interp(grid, time, theta)
    window = 2 * int(0.02 / step) + 5
    speed = np.interp(time, grid, savgol_filter(even, window, 3, deriv=1, delta=step))
    acceleration = np.interp(time, grid, savgol_filter(even, window, 3, deriv=2, delta=step))
    keep = time > time[0] + SETTLE
    sign = np.tanh(speed / CREEP)
    return {"theta": theta[keep], "i": current[keep], "v": speed[keep], "a": acceleration[keep], "s": sign[keep]}


def _profile(sample: Arrays) -> np.ndarray:
    """(bin,) mean current over the turn, empty bins interpolated around it."""
    index = (sample["theta"] % (2 * np.pi) / (2 * np.pi) * BINS).astype(int) % BINS
    count = np.bincount(index, minlength=BINS)
    total = np.bincount(index, sample["i"], minlength=BINS)
    seen = np.flatnonzero(count)
    return np.interp(np.arange(BINS), seen, total[seen] / count[seen], period=BINS)


def find_pole_pairs_and_slots(profile: np.ndarray) -> tuple[int, int]:
    """Pole pairs and slots whose multiples carry the spectrum of a map over one turn, each order costing its noise.

    Where nothing stands out of the noise, the usual 7 and 12.
    """
    power = np.abs(np.fft.rfft(profile))[1 : ORDERS + 1] ** 2
    gain = np.log1p(power / np.median(power)) - 2.0
    order = np.arange(1, ORDERS + 1)
    best, found = STANDS_OUT, (7, 12)
    for p in range(2, 22):
        for slots in range(3, 49, 3):
            if slots == 2 * p or slots == p:
                continue
            score = gain[(order % p == 0) | (order % slots == 0)].sum()
            if score > best:
                best, found = score, (p, slots)
    return found


def recordings(
    case: str, arrays: Arrays
) -> tuple[list[Rows], float, int, int, tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Rows, size of the current (A), pole pairs, slots, names of those that explore and confirm, what to know of them.

    The recordings with most samples come first, so that neither names nor their order in the file matter.

    Raises
    ------
    InputError
        when there is only one recording.
    """
    if len(arrays) < 2:
        raise InputError(f"{case}: one recording leaves nothing to hold out, at least two are needed")
    samples = {name: _samples(values) for name, values in arrays.items()}

    def place(name: str) -> tuple[int, str]:
        return -samples[name]["i"].size, hashlib.sha256(np.ascontiguousarray(arrays[name]).tobytes()).hexdigest()

    names = sorted(arrays, key=place)
    cut = max(1, len(names) // 2)
    first = _profile(samples[names[0]])
    pairs, slots = find_pole_pairs_and_slots(first)
    size = float(first.std())
    notes = [f"spectrum of {names[0]}: {pairs} pole pairs, {slots} slots"]
    rows = []
    for name in names:
        # a map carries no direction of its own: a name that ends in r says that it was taken in reverse
        direction = None if arrays[name].ndim == 2 else (-1.0 if name.endswith("r") else 1.0)
        turn = _shift(first, _profile(samples[name])) if name != names[0] else 0
        if turn:
            notes.append(f"{name}: zero angle turned by {360 * turn / BINS:.0f} deg against {names[0]}")
        samples[name]["theta"] = samples[name]["theta"] + 2 * np.pi * turn / BINS
        rows.append(_rows(name, samples[name], direction, size))
    return rows, size, pairs, slots, tuple(names[:cut]), tuple(names[cut:]), tuple(notes)


def _rows(name: str, sample: Arrays, direction: float | None, size: float) -> Rows:
    angle = sample["theta"] % (2 * np.pi)
    index = (angle / (2 * np.pi) * BINS).astype(int) % BINS
    found = {b: np.flatnonzero(index == b) for b in np.unique(index)}
    found = {b: r for b, r in found.items() if r.size >= 2}
    width = 2 * np.pi / BINS
    place = np.array(list(found)) * width
    order = np.arange(ORDERS + 1)[:, None]
    waves = [np.exp(1j * order * sample["theta"][r]).mean(axis=1) for r in found.values()]
    inputs = {
        "cos": np.array([w.real for w in waves]).T,
        "sin": np.array([w.imag for w in waves]).T,
        "v": np.array([sample["v"][r].mean() for r in found.values()]),
        "a": np.array([sample["a"][r].mean() for r in found.values()]),
        "direction": np.array([sample["s"][r].mean() if direction is None else direction for r in found.values()]),
    }
    variance = np.array([mean_variance(sample["i"][r]) for r in found.values()])
    # a handful of samples per bin tells little of its own noise: most of it is taken from all bins
    variance = 0.2 * variance + 0.8 * variance.mean()
    own, shared = smooth_error(place, ACCURACY * size, 2 * width)
    observed = np.array([sample["i"][r].mean() for r in found.values()])
    return Rows(
        name, "torque", "rotor_angle", place, place + width, observed, own + variance, inputs, shared,
        ["mean current"] * len(found), {"rotor_speed": inputs["v"], "direction": inputs["direction"]},
    )  # fmt: skip


def _shift(first: np.ndarray, other: np.ndarray) -> int:
    """Bins by which ``other`` must be turned to lie best on ``first``."""
    a, b = np.fft.rfft(first - first.mean()), np.fft.rfft(other - other.mean())
    return int(np.argmax(np.fft.irfft(a * np.conj(b), BINS)))


def distortions() -> tuple[Distortion, ...]:
    """Known changes of a recording and what rightly names each."""

    def each(a: Arrays, change) -> Arrays:
        """Apply change(current, theta, size) to the current of maps (where visited) and moves."""
        size = float(np.median([_samples(v)["i"].std() for v in a.values()]))
        result = {}
        for name, values in a.items():
            if values.ndim == 1:
                theta = 2 * np.pi * np.arange(COUNTS) / COUNTS
                result[name] = np.where(values != 0, change(values, theta, size), 0.0)
            else:
                theta = 2 * np.pi * values[1] / COUNTS
                result[name] = np.stack([values[0], values[1], change(values[2], theta, size)])
        return result

    def orders(a: Arrays) -> tuple[int, int]:
        return find_pole_pairs_and_slots(_profile(_samples(next(iter(a.values())))))

    def magnets(a: Arrays) -> Arrays:
        n = orders(a)[1]
        return each(a, lambda i, theta, size: i + size * np.sin(n * theta))

    def eccentric(a: Arrays) -> Arrays:
        return each(a, lambda i, theta, size: i + 1.5 * size * np.cos(theta))

    def alien(a: Arrays) -> Arrays:
        p, slots = orders(a)
        n = next(n for n in range(17, ORDERS) if n % p and n % slots)
        return each(a, lambda i, theta, size: i + 0.5 * size * np.cos(n * theta))

    return (
        Distortion("wave once per slot", magnets, ("rotor_asymmetry",), "torque"),
        Distortion("wave once per turn", eccentric, ("eccentricity",), "torque"),
        Distortion("wave of an order that no cause has", alien, (), "torque"),
    )
