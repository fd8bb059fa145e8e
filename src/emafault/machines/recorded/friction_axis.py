"""Records of a motor-driven axis: cycles to and fro, reduced to mean forces in bins of speed and acceleration."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.signal import butter, find_peaks, sosfiltfilt

from ...errors import InputError
from ..files import read_arrays, require_finite
from ..statement import Arrays, Distortion, Rows
from ..statistics import mean_variance

UNITS = {"t": "s", "qm": "m", "vir": "V", "gtau": "N/V"}
ENDING = ".npz"
ACCURACY = 0.002  # of the largest force in a mean over one bin
BANDWIDTH = 40.0  # Hz, the same filter for position and force before they are binned
SPEED_BINS = 5
STANDSTILL = 0.03  # of the largest speed, below which the sign of the speed is not trusted
SAMPLES = 30  # of a bin, at which friction that is not linear is averaged as the force was


def read(path: Path) -> dict[str, Arrays]:
    """Arrays t, qm, vir and the scalar gtau of one .npz file as one case.

    Raises
    ------
    InputError
        when one is missing, values are not finite, time does not rise evenly, or it is too short.
    """
    arrays = read_arrays(path)
    for name in UNITS:
        if name not in arrays:
            raise InputError(f"{path}: array {name!r} is missing; needed are {', '.join(UNITS)}")
    require_finite(path, arrays, ("t", "qm", "vir"), rows=2000)
    step = np.diff(arrays["t"])
    if not (step.min() > 0 and step.max() < 1.5 * np.median(step)):
        raise InputError(f"{path}: 't' must rise in even steps")
    if not np.isfinite(arrays["gtau"]).all() or arrays["gtau"].size != 1:
        raise InputError(f"{path}: 'gtau' must be one number, N/V")
    return {Path(path).name.split(".")[0]: {name: arrays[name] for name in UNITS}}


def filtered_motion(arrays: Arrays) -> Arrays:
    """Filtered force (N), position (m), speed (m/s), acceleration (m/s2), without the filter's ends."""
    t = arrays["t"]
    step = float(np.median(np.diff(t)))
    sos = butter(4, BANDWIDTH * 2 * step, output="sos")
    q = sosfiltfilt(sos, arrays["qm"])
    force = sosfiltfilt(sos, arrays["vir"]) * float(arrays["gtau"].ravel()[0])
    v = np.gradient(q, step)
    a = np.gradient(v, step)
    inner = slice(int(0.1 / step), -int(0.1 / step))
    return {"t": t[inner], "q": q[inner], "v": v[inner], "a": a[inner], "F": force[inner]}


def cycles(motion: Arrays) -> list[slice]:
    """Stretches between successive lowest positions; halves in time when the axis does not go to and fro."""
    q = motion["q"]
    span = np.ptp(q)
    low, _ = find_peaks(-q, height=-(q.min() + 0.1 * span), prominence=0.5 * span, distance=max(1, q.size // 200))
    edges = [0, *low.tolist(), q.size]
    found = [slice(a, b) for a, b in pairwise(edges) if b - a > 0.05 * q.size]
    return found if len(found) >= 2 else [slice(0, q.size // 2), slice(q.size // 2, q.size)]


def recordings(case: str, arrays: Arrays) -> tuple[list[Rows], dict[str, float], int, int]:
    """Rows of each cycle, sizes of the signals, how many cycles explore, and how many there are.

    Raises
    ------
    InputError
        when a cycle is too short to be looked at bin by bin.
    """
    motion = filtered_motion(arrays)
    found = cycles(motion)
    cut = max(1, len(found) // 2)
    first = {key: values[: found[cut - 1].stop] for key, values in motion.items()}
    scale = {key: float(np.abs(first[key]).max()) for key in ("v", "a", "F")}
    scale["q"], scale["t"] = float(np.ptp(first["q"])), float(first["t"][-1])
    middle = float(first["q"].mean())
    rows = [
        _rows(f"cycle {k}", {n: x[s] for n, x in motion.items()}, scale, middle) for k, s in enumerate(found, start=1)
    ]
    if min(r.size for r in rows) < 6:
        raise InputError(
            f"{case}: a cycle has fewer than 6 bins of speed, direction and acceleration with enough samples"
        )
    return rows, scale, cut, len(found)


def _rows(name: str, x: Arrays, scale: Mapping[str, float], middle: float) -> Rows:
    edges = np.linspace(STANDSTILL, 1.0001, SPEED_BINS + 1)
    way = np.sign(x["v"])
    speed = np.digitize(np.abs(x["v"]) / scale["v"], edges)
    pushing = np.digitize(x["a"] / scale["a"], [-0.1, 0.1])
    side = (x["q"] > middle).astype(int)
    ends, labels, bins = [], [], []
    for sign, level, push, half in np.ndindex(2, SPEED_BINS, 3, 2):
        sign = 1 - 2 * sign
        inside = np.flatnonzero((way == sign) & (speed == level + 1) & (pushing == push) & (side == half))
        if inside.size < SAMPLES:
            continue
        ends.append(sorted((sign * edges[level] * scale["v"], sign * edges[level + 1] * scale["v"])))
        pushed = ("braking", "cruising", "speeding up")[push if sign > 0 else 2 - push]
        labels.append(f"{pushed}, {('lower', 'upper')[half]} half")
        bins.append(inside)
    derived = {
        "a": x["a"], "v": x["v"], "q": x["q"] - middle, "t": x["t"],
        "sign": way, "speed": np.abs(x["v"]), "square": x["v"] * np.abs(x["v"]), "push": np.abs(x["a"]) * way,
        "place": way * (x["q"] - middle), "drift": way * x["t"],
    }  # fmt: skip
    inputs = {key: np.array([values[b].mean() for b in bins]) for key, values in derived.items()}
    inputs["samples"] = np.array([x["v"][b[np.linspace(0, b.size - 1, SAMPLES).astype(int)]] for b in bins])
    inputs["v_max"] = np.array([scale["v"]])
    variance = np.array([mean_variance(x["F"][b]) for b in bins]) + (ACCURACY * scale["F"]) ** 2
    low, high = np.array(ends).reshape(-1, 2).T
    return Rows(
        name, "torque", "rotor_speed", low, high, np.array([x["F"][b].mean() for b in bins]), variance, inputs,
        labels=labels, beside={"time": inputs["t"], "direction": inputs["sign"], "position": inputs["q"]},
    )  # fmt: skip


def distortions() -> tuple[Distortion, ...]:
    """Known changes of a recording and what rightly names each."""

    def forced(a: Arrays, change) -> Arrays:
        step = float(np.median(np.diff(a["t"])))
        q = sosfiltfilt(butter(4, BANDWIDTH * 2 * step, output="sos"), a["qm"])
        v = np.gradient(q, step)
        return a | {"vir": a["vir"] + np.abs(a["vir"]).max() * change(q, v / np.abs(v).max(), a["t"])}

    def offset(a: Arrays) -> Arrays:
        return forced(a, lambda q, v, t: 0.1)

    def stribeck(a: Arrays) -> Arrays:
        return forced(a, lambda q, v, t: 0.2 * np.sign(v) * np.exp(-((v / 0.2) ** 2)))

    def spring(a: Arrays) -> Arrays:
        return forced(a, lambda q, v, t: 0.1 * (q - q.mean()) / np.ptp(q))

    def wave(a: Arrays) -> Arrays:
        return forced(a, lambda q, v, t: 0.1 * np.sin(2 * np.pi * t / (0.165 * t[-1])))

    return (
        Distortion("constant force", offset, ("offset", "coulomb_asymmetry"), "torque"),
        Distortion("friction higher at low speed", stribeck, ("stribeck",), "torque"),
        Distortion("force in proportion to position", spring, ("load_spring",), "torque"),
        Distortion("force that waves in time", wave, (), "torque"),
    )
