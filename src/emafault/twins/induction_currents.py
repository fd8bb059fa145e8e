"""A line-fed induction motor known by its phase currents: which phase has shorted turns, or that it cannot be said.

Base model, positive-sequence current I_1 with an unbalance u_0 of supply and sensors (from the healthy recording):
    I_2 / I_1 = u_0,   I_0 / I_1 = z_0
Shorted turns in phase x load that phase alone with a current d I_1 exp(i gamma) (d its part of I_1, gamma its lead
over the phase's own current; between 0 when it is as inductive as the motor and 90 deg when it is resistive). With no
neutral its return runs through the other two phases in equal parts, so that with a = exp(2 pi i / 3)
    I_2 / I_1 = u_0 + d/2 exp(i gamma) a^n,   n = 0, 1, 2 for the phases in the order of the sequence
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from emafault.errors import InputError
from emafault.gap.twin import Cell, Parameter
from emafault.twins.measured import (
    Arrays,
    Block,
    Distortion,
    MeasuredTwin,
    freedom,
    library,
    nuisance,
    read_arrays,
    require_finite,
)
from emafault.twins.measured_experiments import Experiment

NAME = "induction_currents"
RATE = 1000.0  # Hz
WINDOWS = 6
REPEATABILITY = 0.012  # of I_1: how well unbalance repeats between recordings of an unchanged machine, at least
STEADINESS = 0.003  # of I_1: change of unbalance within a recording that a sound machine may show
WANDERING = 0.08  # of its unbalance: change within a recording of a short that warms up or meets the rotor's slip
UNKNOWN_UNBALANCE = 0.04  # of I_1: supply and sensors, where no healthy recording is given
HEALTHY = "HLT"


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


def build(case: str, arrays: Arrays) -> MeasuredTwin:
    """Twin of one condition: the first half of the repetitions explores, the others confirm."""
    i = arrays["i"]
    order = _order(i[0])
    unbalance, zero, spread = _healthy(arrays)
    names = [f"repetition {k + 1}" for k in range(len(i))]
    cut = _explored(i)
    blocks = {name: _block(name, rows, order, unbalance, spread) for name, rows in zip(names, i)}
    notes = [f"phase sequence {'A B C' if order > 0 else 'A C B'}"]
    if "healthy" not in arrays:
        notes.append("no healthy recording: supply unbalance and a shorted phase are told apart by size alone")
    parameters = _parameters(unbalance, zero, spread)
    return MeasuredTwin(
        NAME, case, tuple(names[:cut]), tuple(names[cut:]), blocks, parameters,
        library(parameters, _equations(), SHORT_STARTS),
        _model, notes=tuple(notes),
    )  # fmt: skip


def _healthy(arrays: Arrays) -> tuple[complex, complex, float]:
    """Unbalance I_2/I_1 and I_0/I_1 of the healthy recordings, and how far they repeat (of I_1)."""
    if "healthy" not in arrays:
        return 0j, 0j, UNKNOWN_UNBALANCE
    means = np.array([sequences(rows)[:, 1:3].mean(axis=0) for rows in arrays["healthy"]])
    scatter = np.sqrt((np.abs(means - means.mean(axis=0)) ** 2).sum(axis=0) / 2 / max(1, len(means) - 1))
    return complex(means[:, 0].mean()), complex(means[:, 1].mean()), float(max(REPEATABILITY, *scatter))


def _block(name: str, i: np.ndarray, order: float, unbalance: complex, spread: float) -> Block:
    s = sequences(i)
    values = np.stack([s[:, 1].real, s[:, 1].imag, s[:, 2].real, s[:, 2].imag], axis=1)
    time = (np.arange(len(s)) + 0.5) * len(i) / RATE / len(s)
    half = 0.5 * len(i) / RATE / len(s)
    cells, kind = [], []
    for k, label in enumerate(("Re I2/I1", "Im I2/I1", "Re I0/I1", "Im I0/I1")):
        cells += [Cell(name, ("electrical", "sensor_current")[k // 2], "time", t - half, t + half, label) for t in time]
        kind += [k] * len(s)
    variance = np.tile(s[:, 3].real ** 2, 4) + (WANDERING * abs(s[:, 1].mean() - unbalance)) ** 2
    # unbalance changes from recording to recording: one error shared by all windows of a repetition
    shared = np.kron(np.eye(4), np.full((len(s), len(s)), min(spread, 2 * REPEATABILITY) ** 2))
    inputs = {"kind": np.array(kind), "order": np.full(len(kind), order)}
    # by how many phases probes and supply leads have been moved on against the windings
    inputs |= {"probe": np.array([0]), "lead": np.array([0])}
    return Block(cells, values.T.ravel(), shared + np.diag(variance + STEADINESS**2), inputs)


def _parameters(unbalance: complex, zero: complex, spread: float) -> tuple[Parameter, ...]:
    sd = max(spread, REPEATABILITY)
    found = [
        nuisance("u_re", "1", unbalance.real, sd, specified="electrical"),
        nuisance("u_im", "1", unbalance.imag, sd, specified="electrical"),
        nuisance("z_re", "1", zero.real, 3 * sd, specified="sensor_current"),
        nuisance("z_im", "1", zero.imag, 3 * sd, specified="sensor_current"),
    ]
    for c in "abc":
        found += [
            freedom(f"shorted_turns_{c}", f"d_{c}", "1", 0.3, 0.0, 3.0),
            # lead of the short's current: 0 as inductive as the motor, 90 deg resistive at no load
            freedom(f"shorted_turns_{c}", f"gamma_{c}", "rad", 0.4, -0.5, 2.0, mean=0.9, off=0.9),
        ]
    found += [freedom(f"current_gain_{c}", f"gain_{c}", "1", 0.2, -0.8, 0.8) for c in "abc"]
    found += [freedom("supply_unbalance", f"supply_{part}", "1", 0.05, -0.5, 0.5) for part in ("re", "im")]
    return tuple(found)


def _equations() -> dict[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {f"shorted_turns_{c}": ("electrical",) for c in "abc"}
    found |= {f"current_gain_{c}": ("sensor_current",) for c in "abc"}
    return found | {"supply_unbalance": ("electrical",)}


SHORT_STARTS = {f"shorted_turns_{c}": ((0.1, 0.9), (0.4, 0.3), (0.4, 1.4)) for c in "abc"}


def _model(p: Mapping[str, np.ndarray], block: Block) -> np.ndarray:
    """(point, statistic): real and imaginary parts of I_2/I_1 and I_0/I_1 in each window."""
    x = block.inputs
    turn = np.exp(2j * np.pi / 3 * x["order"][0])
    one = np.ones_like(p["u_re"], dtype=complex)
    # phase currents over I_1, from the positive sequence of unit size
    base = [one * turn ** (-n) for n in range(3)]
    current = [c.copy() for c in base]
    unbalance = p["u_re"] + p["supply_re"] + 1j * (p["u_im"] + p["supply_im"])
    unbalance = unbalance * turn ** (2 * x["lead"][0])
    for n, c in enumerate("abc"):
        current[n] = current[n] + unbalance * turn**n
        short = p[f"d_{c}"] * np.exp(1j * p[f"gamma_{c}"]) * base[n]
        for m in range(3):
            current[m] = current[m] + (short if m == n else -0.5 * short)
    zero = p["z_re"] + 1j * p["z_im"]
    gains = [1 + p[f"gain_{'abc'[(n + x['probe'][0]) % 3]}"] for n in range(3)]
    current = [(i + zero) * gain for i, gain in zip(current, gains)]
    first = sum(i * turn**n for n, i in enumerate(current)) / 3
    second = sum(i * turn ** (-n) for n, i in enumerate(current)) / 3 / first
    zeroth = sum(current) / 3 / first
    parts = (second.real, second.imag, zeroth.real, zeroth.imag)
    return np.choose(x["kind"], [part + np.zeros(x["kind"].shape) for part in parts])


def experiments() -> tuple[Experiment, ...]:
    """A gain follows its channel, an unbalance the supply, a short the winding."""
    return (
        Experiment("every current probe moved on by one phase", lambda x: {"probe": x["probe"] + 1}),
        Experiment("every supply lead moved on by one phase", lambda x: {"lead": x["lead"] + 1}),
    )


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
