"""Open-circuit voltages of an oscilloscope: recordings at a constant speed, reduced to harmonics of each channel."""

import hashlib
import re
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from ...errors import InputError
from ..files import read_arrays, require_finite
from ..statement import Arrays, Distortion, Rows

ORDERS = 13  # highest harmonic
ACCURACY = 0.003  # of a channel's fundamental: vertical resolution and linearity of the scope
POLE_PAIRS = 7  # where the name of a recording gives no speed from which to find them


def read(path: Path) -> dict[str, Arrays]:
    """Recordings ``t_NAME``, ``v_NAME`` of one .npz file as one case.

    Raises
    ------
    InputError
        when there is no such pair, shapes do not fit, or values are not finite.
    """
    arrays = read_arrays(path)
    names = [key[2:] for key in arrays if key.startswith("t_")]
    if not names:
        raise InputError(f"{path}: no recording; needed are arrays t_NAME (s) and v_NAME (V, shape (samples, 3))")
    for name in names:
        if f"v_{name}" not in arrays:
            raise InputError(f"{path}: array 'v_{name}' is missing")
        if arrays[f"v_{name}"].ndim != 2 or arrays[f"v_{name}"].shape[1] != 3:
            raise InputError(f"{path}: 'v_{name}' has shape {arrays[f'v_{name}'].shape}, needed is (samples, 3)")
        require_finite(path, arrays, (f"t_{name}", f"v_{name}"), rows=200)
        if not (np.diff(arrays[f"t_{name}"]) > 0).all():
            raise InputError(f"{path}: 't_{name}' must rise")
        if not arrays[f"v_{name}"].std(axis=0).all():
            raise InputError(f"{path}: 'v_{name}' has a channel that is constant")
    return {Path(path).name.split(".")[0]: {key: v for key, v in arrays.items() if key[2:] in names}}


def fundamental(t: np.ndarray, v: np.ndarray) -> float:
    """Electrical frequency (Hz) that explains most of all channels, each weighed by its own size.

    Raises
    ------
    InputError
        when less than two periods were recorded.
    """
    scaled = (v - v.mean(axis=0)) / v.std(axis=0)
    step, span = (t[-1] - t[0]) / (t.size - 1), t[-1] - t[0]
    power = (np.abs(np.fft.rfft(scaled * np.hanning(t.size)[:, None], 4 * t.size, axis=0)) ** 2).sum(axis=1)
    first = int(4 * 1.0)  # below one period per record nothing is a frequency
    coarse = (first + int(np.argmax(power[first:]))) / (4 * t.size * step)

    def rest(f: float) -> float:
        X = _design(t, f, 3)
        return float(((scaled - X @ np.linalg.lstsq(X, scaled, rcond=None)[0]) ** 2).sum())

    bounds = (coarse - 0.5 / span, coarse + 0.5 / span)
    f = minimize_scalar(rest, bounds=bounds, method="bounded", options={"xatol": 1e-6 / span}).x
    if f * span < 2:
        raise InputError(f"{f * span:.1f} electrical periods recorded, at least 2 are needed")
    return float(f)


def _design(t: np.ndarray, f: float, orders: int) -> np.ndarray:
    angle = 2 * np.pi * f * t[:, None] * np.arange(1, orders + 1)
    return np.concatenate([np.ones((t.size, 1)), np.cos(angle), np.sin(angle)], axis=1)


def harmonics(t: np.ndarray, v: np.ndarray, f: float) -> np.ndarray:
    """(order, phase) complex amplitudes of v = Re(c exp(i n theta)), theta zero at the first channel's rising zero."""
    b = np.linalg.lstsq(_design(t, f, ORDERS), v, rcond=None)[0]
    c = np.concatenate([b[:1].astype(complex), b[1 : ORDERS + 1] - 1j * b[ORDERS + 1 :]])
    shift = np.angle(c[1, 0]) + np.pi / 2
    return c * np.exp(-1j * shift * np.arange(ORDERS + 1))[:, None]


def recordings(
    case: str, arrays: Arrays
) -> tuple[list[Rows], float, tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Rows, usual k (V s/rad), names of the recordings that explore and confirm, and what to know of them.

    Raises
    ------
    InputError
        when there is only one recording: nothing is left to hold out.
    """
    names = [key[2:] for key in arrays if key.startswith("t_")]
    if len(names) < 2:
        raise InputError(f"{case}: one recording leaves nothing to hold out, at least two are needed")
    # what confirms is told by the recordings themselves and not by their order in the file
    names.sort(key=lambda n: hashlib.sha256(np.ascontiguousarray(arrays[f"v_{n}"]).tobytes()).hexdigest())
    f = {name: fundamental(arrays[f"t_{name}"], arrays[f"v_{name}"]) for name in names}
    named = {name: int(m.group(1)) for name in names if (m := re.match(r"(\d+)rpm", name))}
    pairs = round(float(np.median([60 * f[n] / rpm for n, rpm in named.items()]))) if named else POLE_PAIRS
    fast = [name for name in names if f[name] > 0.95 * max(f.values())]
    confirm = fast if len(fast) < len(names) else names[-max(1, len(names) // 3) :]
    explore = [name for name in names if name not in confirm]
    c = {name: harmonics(arrays[f"t_{name}"], arrays[f"v_{name}"], f[name]) for name in names}
    scale = float(np.median([np.abs(c[n][1, 0]) / (2 * np.pi * f[n] / pairs) for n in explore]))
    for name in names:
        size = np.abs(c[name][1])
        if size.min() < 1e-4 * size.max():
            raise InputError(f"{case}: 'v_{name}' channel {int(np.argmin(size)) + 1} shows no wave at {f[name]:.1f} Hz")
    rows = [r for n in names for r in _rows(n, arrays, f[n], c[n], 2 * np.pi * f[n] / pairs)]
    notes = [f"{pairs} pole pairs; speeds " + ", ".join(f"{n} {60 * f[n] / pairs:.1f} 1/min" for n in sorted(names))]
    notes += [
        f"{n}: the waveform says {60 * f[n] / pairs:.0f} 1/min, the name {rpm}"
        for n, rpm in named.items() if abs(60 * f[n] / pairs / rpm - 1) > 0.02
    ]  # fmt: skip
    notes.append("a small difference of a channel's gain and of a phase's k look alike at open circuit")
    return rows, scale, tuple(explore), tuple(confirm), tuple(notes)


def _rows(name: str, arrays: Arrays, f: float, c: np.ndarray, omega: float) -> list[Rows]:
    t, v = arrays[f"t_{name}"], arrays[f"v_{name}"]
    # scatter between stretches of whole electrical periods is the repeatability of each coefficient
    periods = int(f * (t[-1] - t[0]))
    parts = min(8, max(2, periods // 2))
    length = int(periods / parts / f / ((t[-1] - t[0]) / (t.size - 1)))
    stretches = [slice(k * length, (k + 1) * length) for k in range(parts)]
    pieces = np.stack([relative(harmonics(t[s], v[s], f)) for s in stretches])
    values = relative(c)
    # the phase that follows a third of a turn behind the first
    sequence = -np.sign(np.angle(c[1, 1] / c[1, 0]))
    ideal = np.exp(-2j * np.pi / 3 * sequence * np.arange(3))
    # angles are counted from where the sequence puts each phase, so that none is near half a turn
    values[1].imag = np.angle(np.exp(1j * values[1].imag) / ideal)
    pieces[:, 1].imag = np.angle(np.exp(1j * pieces[:, 1].imag) / ideal)
    found: dict[str, list[tuple[int, int, int, float, float, str]]] = {}
    for channel, n, part in np.ndindex(3, ORDERS + 1, 2):
        if part == 1 and (n == 0 or (n == 1 and channel == 0)):
            continue  # no imaginary offset; the first channel defines the angle
        number = (values[n, channel].real, values[n, channel].imag)[part]
        scatter = (pieces[:, n, channel].real, pieces[:, n, channel].imag)[part]
        kind = (("log amplitude", "angle") if n == 1 else ("cos", "sin"))[part]
        entry = n, channel, part, float(number), float(scatter.var(ddof=1) / parts), f"channel {channel + 1}, {kind}"
        found.setdefault("sensor_voltage" if n == 0 else f"electrical_{'abc'[channel]}", []).append(entry)
    out = []
    for equation, entries in found.items():
        order, phase, part, observed, variance, labels = (np.array(x) for x in zip(*entries, strict=True))
        inputs = {"order": order, "phase": phase, "part": part, "channel": phase}  # the channel that shows the phase
        inputs |= {"w": np.full(len(order), omega), "sequence": np.full(len(order), sequence)}
        place = order.astype(float)
        out.append(
            Rows(
                name, equation, "order", place, place, observed, variance + ACCURACY**2, inputs, labels=labels.tolist()
            )
        )
    return out


def relative(c: np.ndarray) -> np.ndarray:
    """(order, phase) harmonics in parts of each channel's fundamental; order 1 holds log amplitude + i angle."""
    out = c / np.abs(c[1])
    out[1] = np.log(np.abs(c[1])) + 1j * np.angle(c[1] / c[1, 0])
    return out


def distortions() -> tuple[Distortion, ...]:
    """Known changes of a recording and what rightly names each."""

    def each(a: Arrays, change) -> Arrays:
        return {key: change(v, a["t_" + key[2:]]) if key.startswith("v_") else v for key, v in a.items()}

    def gain(a: Arrays) -> Arrays:
        return each(a, lambda v, t: v * np.array([1.0, 10.0, 1.0]))

    def offset(a: Arrays) -> Arrays:
        return each(a, lambda v, t: v + np.array([0.0, 0.0, 1.0]) * v[:, 2:].std())

    def third(a: Arrays) -> Arrays:
        return each(
            a,
            lambda v, t: (
                v - 0.1 * (v - v.mean(axis=0)) * (4 * ((v - v.mean(axis=0)) / (1.42 * v.std(axis=0))) ** 2 - 3)
            ),
        )

    def clipped(a: Arrays) -> Arrays:
        return each(a, lambda v, t: np.column_stack([np.minimum(v[:, 0], 0.7 * v[:, 0].max()), v[:, 1], v[:, 2]]))

    return (
        Distortion("second channel ten times larger", gain, ("channel_gain_b",), "electrical_b"),
        Distortion("offset on the third channel", offset, ("channel_offset",), "sensor_voltage"),
        Distortion("third harmonic of 10 %", third, ("shape_3",), "electrical_a"),
        Distortion("first channel clipped", clipped, (), "electrical_a"),
    )
