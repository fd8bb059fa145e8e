"""Phase currents of a line-fed motor: sequences in windows, and what a healthy recording says of the supply."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..files import read_arrays, require_finite
from ..statement import Arrays, Distortion, Rows

RATE = 1000.0  # Hz
WINDOWS = 6
REPEATABILITY = 0.012  # of I_1: how well unbalance repeats between recordings of an unchanged machine, at least
STEADINESS = 0.003  # of I_1: change of unbalance within a recording that a sound machine may show
WANDERING = 0.08  # of its unbalance: change within a recording of a short that warms up or meets the rotor's slip
UNKNOWN_UNBALANCE = 0.04  # of I_1: supply and sensors, where no healthy recording is given
HEALTHY = "HLT"


@dataclass(frozen=True)
class Found:
    """What ``recordings`` makes of a condition."""

    rows: Sequence[Rows]
    explore: tuple[str, ...]
    confirm: tuple[str, ...]
    unbalance: complex  # I_2/I_1 and I_0/I_1 of supply and sensors
    zero: complex
    spread: float  # of I_1, how far the former are known
    notes: tuple[str, ...]
    observed: Mapping[str, Mapping[str, float]]


def read(path: Path) -> dict[str, Arrays]:
    """Arrays (repetition, sample, 3) of one .npz file; each is a case, compared with the array whose name ends in HLT.

    Raises
    ------
    InputError
        when an array has another shape or is not finite.
    """
    arrays = read_arrays(path)
    if not arrays:
        raise InputError(f"{path}: holds no array")
    for name, values in arrays.items():
        if values.ndim != 3 or values.shape[2] != 3 or values.shape[1] < 200 or values.shape[0] < 2:
            raise InputError(
                f"{path}: {name!r} has shape {values.shape}; needed is (repetition >= 2, sample >= 200, 3)"
            )
        require_finite(path, {name: values.reshape(-1, 3)}, (name,), rows=1)
    healthy = [values for name, values in arrays.items() if name.endswith(HEALTHY)]
    cases = {name: {"i": values} | ({"healthy": healthy[0]} if healthy else {}) for name, values in arrays.items()}
    for name, case in cases.items():
        if name.endswith(HEALTHY):
            # the healthy machine itself is judged against its own first repetitions, not against what is held out
            case["healthy"] = case["i"][: _explored(case["i"])]
    return cases


def _explored(i: np.ndarray) -> int:
    """How many of the repetitions explore."""
    return max(1, len(i) // 2)


def frequency(i: np.ndarray) -> float:
    """Line frequency (Hz) of currents (sample, phase) sampled at RATE."""
    window = np.hanning(len(i))[:, None]
    power = (np.abs(np.fft.rfft(i * window, 16 * len(i), axis=0)) ** 2).sum(axis=1)
    first = int(16 * len(i) * 5 / RATE)
    peak = min(first + int(np.argmax(power[first:])), power.size - 2)
    left, middle, right = np.log(power[peak - 1 : peak + 2])
    return float((peak + 0.5 * (left - right) / (left - 2 * middle + right)) * RATE / (16 * len(i)))


def sequences(i: np.ndarray) -> np.ndarray:
    """(window, 4) I_1, I_2/I_1, I_0/I_1 and the noise of the latter two, of (sample, phase) currents.

    Positive is the sequence that the currents show themselves.
    """
    f = frequency(i)
    per_window = max(1, int(len(i) / WINDOWS * f / RATE))
    length = int(per_window * RATE / f)
    a = np.exp(2j * np.pi / 3)
    result = []
    for k in range(min(WINDOWS, len(i) // length)):
        part = i[k * length : (k + 1) * length]
        t = (k * length + np.arange(length)) / RATE
        X = np.column_stack([np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t), np.ones(length)])
        b = np.linalg.lstsq(X, part, rcond=None)[0]
        c = b[0] - 1j * b[1]
        forward, backward = (c[0] + a * c[1] + a**2 * c[2]) / 3, (c[0] + a**2 * c[1] + a * c[2]) / 3
        if abs(backward) > abs(forward):
            forward, backward = backward, forward
        noise = np.sqrt((part - X @ b).var(axis=0).mean() * 2 / length) / abs(forward)
        result.append([forward, backward / forward, c.mean() / forward, noise])
    return np.array(result)


def _order(i: np.ndarray) -> float:
    """+1 when phase B follows A by a third of a turn, -1 when C does."""
    c = np.linalg.lstsq(
        np.column_stack([g(2 * np.pi * frequency(i) * np.arange(len(i)) / RATE) for g in (np.cos, np.sin)]),
        i,
        rcond=None,
    )[0]
    phasor = c[0] - 1j * c[1]
    return float(-np.sign(np.imag(phasor[1] / phasor[0] - phasor[2] / phasor[0])))


def recordings(arrays: Arrays) -> Found:
    """Rows of one condition, split by repetition, and what is known of supply and sensors."""
    i = arrays["i"]
    order = _order(i[0])
    unbalance, zero, spread = _healthy(arrays)
    names = [f"repetition {k + 1}" for k in range(len(i))]
    cut = _explored(i)
    notes = [f"phase sequence {'A B C' if order > 0 else 'A C B'}"]
    observed: dict[str, dict[str, float]] = {}
    if "healthy" not in arrays:
        notes.append("no healthy recording: supply unbalance and a shorted phase are distinguished by size alone")
    elif _order(arrays["healthy"][0]) != order:
        # of a healthy machine with two leads exchanged the size of the unbalance is known, not where it points
        spread, unbalance, zero = float(np.hypot(abs(unbalance), spread)), 0j, 0j
        observed["phases_exchanged"] = {}
        notes.append("two phases are exchanged against the healthy recording: which ones, these currents do not show")
    rows = [r for name, part in zip(names, i, strict=True) for r in _rows(name, part, order, unbalance, spread)]
    return Found(rows, tuple(names[:cut]), tuple(names[cut:]), unbalance, zero, spread, tuple(notes), observed)


def _rows(name: str, i: np.ndarray, order: float, unbalance: complex, spread: float) -> list[Rows]:
    s = sequences(i)
    count = len(s)
    half = 0.5 * len(i) / RATE / count
    time = np.tile((2 * np.arange(count) + 1) * half, 2)
    part = np.repeat([0, 1], count)
    wandering = (WANDERING * abs(s[:, 1].mean() - unbalance)) ** 2 + STEADINESS**2
    # unbalance changes from recording to recording: one error shared by all windows of a repetition
    shared = np.kron(np.eye(2), np.full((count, 1), min(spread, 2 * REPEATABILITY)))
    # probe, lead: by how many phases probes and supply leads have been moved on against the windings
    inputs = {"part": part, "order": np.full(2 * count, order), "probe": np.array([0]), "lead": np.array([0])}
    found = []
    for column, equation, letter in ((1, "electrical", "I2"), (2, "sensor_current", "I0")):
        observed = np.concatenate([s[:, column].real, s[:, column].imag])
        labels = [f"{('Re', 'Im')[k]} {letter}/I1" for k in part]
        variance = np.tile(s[:, 3].real ** 2, 2) + wandering
        found.append(Rows(name, equation, "time", time - half, time + half, observed, variance, inputs, shared, labels))
    return found


def _healthy(arrays: Arrays) -> tuple[complex, complex, float]:
    """Unbalance I_2/I_1 and I_0/I_1 of the healthy recordings, and how far they repeat (of I_1)."""
    if "healthy" not in arrays:
        return 0j, 0j, UNKNOWN_UNBALANCE
    means = np.array([sequences(rows)[:, 1:3].mean(axis=0) for rows in arrays["healthy"]])
    scatter = np.sqrt((np.abs(means - means.mean(axis=0)) ** 2).sum(axis=0) / 2 / max(1, len(means) - 1))
    return complex(means[:, 0].mean()), complex(means[:, 1].mean()), float(max(REPEATABILITY, *scatter))


def distortions() -> tuple[Distortion, ...]:
    """Known changes of a recording and what rightly names each."""

    def gain(a: Arrays) -> Arrays:
        return a | {"i": a["i"] * np.array([1.0, 1.3, 1.0])}

    def short(a: Arrays) -> Arrays:
        """Add to phase C a current that leads its own by 60 degrees, its return through the others."""
        i = a["i"]
        extra = np.empty_like(i)
        for k, rows in enumerate(i):
            f = frequency(rows)
            t = np.arange(len(rows)) / RATE
            X = np.column_stack([np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t)])
            b = np.linalg.lstsq(X, rows[:, 2], rcond=None)[0]
            phasor = 0.4 * (b[0] - 1j * b[1]) * np.exp(1j * np.pi / 3)
            wave = (phasor * np.exp(2j * np.pi * f * t)).real
            extra[k] = wave[:, None] * np.array([-0.5, -0.5, 1.0])
        return a | {"i": i + extra}

    def pickup(a: Arrays) -> Arrays:
        """The same current beside the line's frequency on all channels: it beats in the zero sequence."""
        t = np.arange(a["i"].shape[1]) / RATE
        beat = np.sin(2 * np.pi * (frequency(a["i"][0]) + 1.5) * t)
        return a | {"i": a["i"] + 0.3 * a["i"].std() * beat[:, None]}

    return (
        Distortion("second channel's gain +30 %", gain, ("current_gain_b",), "sensor_current"),
        Distortion("short in phase C", short, ("shorted_turns_c",), "electrical"),
        Distortion("pick-up that beats with the line", pickup, (), "sensor_current"),
    )
