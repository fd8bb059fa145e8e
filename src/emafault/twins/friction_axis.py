"""A motor-driven axis with friction: position and force command at millisecond steps.

Base model, force F = gtau vir, v the speed and a the acceleration:
    F = M a + F_v v + F_c sign(v)
"""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.signal import butter, find_peaks, sosfiltfilt

from emafault.errors import InputError
from emafault.gap.twin import Cell, Parameter
from emafault.twins.measured import (
    Arrays,
    Block,
    Distortion,
    MeasuredTwin,
    freedom,
    library,
    mean_variance,
    nuisance,
    read_arrays,
    require_finite,
)
from emafault.twins.measured_experiments import Experiment, scaled

NAME = "friction_axis"
ACCURACY = 0.002  # of the largest force in a mean over one bin
BANDWIDTH = 40.0  # Hz, the same filter for position and force before they are binned
SPEED_BINS = 5
STANDSTILL = 0.03  # of the largest speed, below which the sign of the speed is not trusted


def read(path: Path) -> dict[str, Arrays]:
    """Arrays t, qm, vir and the scalar gtau of one .npz file as one case.

    Raises
    ------
    InputError
        when one is missing, values are not finite, time does not rise evenly, or it is too short.
    """
    arrays = read_arrays(path)
    for name in ("t", "qm", "vir", "gtau"):
        if name not in arrays:
            raise InputError(f"{path}: array {name!r} is missing; needed are t, qm, vir, gtau")
    require_finite(path, arrays, ("t", "qm", "vir"), rows=2000)
    step = np.diff(arrays["t"])
    if not (step.min() > 0 and step.max() < 1.5 * np.median(step)):
        raise InputError(f"{path}: 't' must rise in even steps")
    if not np.isfinite(arrays["gtau"]).all() or arrays["gtau"].size != 1:
        raise InputError(f"{path}: 'gtau' must be one number, N/V")
    return {Path(path).name.split(".")[0]: {name: arrays[name] for name in ("t", "qm", "vir", "gtau")}}


def _motion(arrays: Arrays) -> Arrays:
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


def build(case: str, arrays: Arrays) -> MeasuredTwin:
    """Twin of one record: the earlier cycles explore, the later ones confirm."""
    motion = _motion(arrays)
    found = cycles(motion)
    cut = max(1, len(found) // 2)
    names = [f"cycle {number}" for number in range(1, len(found) + 1)]
    scale = {key: float(np.abs(motion[key]).max()) for key in ("v", "a", "F")}
    scale["q"], scale["t"] = float(np.ptp(motion["q"])), float(motion["t"][-1])
    middle = float(motion["q"].mean())
    blocks = {n: _block(n, {k: x[s] for k, x in motion.items()}, scale, middle) for n, s in zip(names, found)}
    if min(len(b.observed) for b in blocks.values()) < 6:
        raise InputError(
            f"{case}: a cycle has fewer than 6 bins of speed, direction and acceleration with enough samples"
        )
    parameters = _parameters(scale)
    starts = {"stribeck": tuple((0.1 * scale["F"], float(np.log(x))) for x in (0.1, 0.4))}
    return MeasuredTwin(
        NAME, case, tuple(names[:cut]), tuple(names[cut:]), blocks, parameters,
        library(parameters, _equations(), starts), _model,
        notes=(
            f"{cut} of {len(found)} cycles explore",
            "an error of gtau scales mass and friction alike: this record cannot show it",
        ),
        coordinates={"rotor_speed": "speed (m/s)"},
    )  # fmt: skip


def _block(name: str, x: Arrays, scale: Mapping[str, float], middle: float) -> Block:
    edges = np.linspace(STANDSTILL, 1.0001, SPEED_BINS + 1)
    speed = np.digitize(np.abs(x["v"]) / scale["v"], edges)
    pushing = np.digitize(x["a"] / scale["a"], [-0.1, 0.1])
    side = (x["q"] > middle).astype(int)
    cells, rows_of = [], []
    for way in (1, -1):
        for level in range(1, SPEED_BINS + 1):
            for push in range(3):
                for half in range(2):
                    rows = np.flatnonzero(
                        (np.sign(x["v"]) == way) & (speed == level) & (pushing == push) & (side == half)
                    )
                    if rows.size < 30:
                        continue
                    low, high = sorted((way * edges[level - 1] * scale["v"], way * edges[level] * scale["v"]))
                    pushed = ("braking", "cruising", "speeding up")[push if way > 0 else 2 - push]
                    label = f"{pushed}, {('lower', 'upper')[half]} half"
                    cells.append(Cell(name, "torque", "rotor_speed", low, high, label))
                    rows_of.append(rows)
    # a decimated set of samples per bin lets nonlinear friction be averaged over the bin as the force was
    picks = [rows[np.linspace(0, rows.size - 1, 30).astype(int)] for rows in rows_of]
    inputs = {key: np.array([x[key][rows].mean() for rows in rows_of]) for key in ("a", "v", "q", "t")}
    sign = np.sign(x["v"])
    derived = {
        "sign": sign, "speed": np.abs(x["v"]), "square": x["v"] * np.abs(x["v"]), "push": np.abs(x["a"]) * sign,
        "place": sign * (x["q"] - middle), "drift": sign * x["t"],
    }  # fmt: skip
    inputs |= {key: np.array([values[rows].mean() for rows in rows_of]) for key, values in derived.items()}
    inputs["q"] = inputs["q"] - middle
    inputs["samples"] = np.array([x["v"][rows] for rows in picks])
    inputs["v_max"] = np.array([scale["v"]])
    variance = [mean_variance(x["F"][rows]) for rows in rows_of]
    covariance = np.diag(np.array(variance) + (ACCURACY * scale["F"]) ** 2)
    return Block(cells, np.array([x["F"][rows].mean() for rows in rows_of]), covariance, inputs)


def _parameters(scale: Mapping[str, float]) -> tuple[Parameter, ...]:
    F, v, a = scale["F"], scale["v"], scale["a"]
    return (
        nuisance("M", "kg", 0.5 * F / a, F / a, low=0.0),
        nuisance("F_v", "N s/m", 0.1 * F / v, 0.3 * F / v, low=0.0),
        nuisance("F_c", "N", 0.1 * F, 0.3 * F, low=0.0),
        freedom("offset", "F_0", "N", 0.05 * F, -F, F),
        freedom("coulomb_asymmetry", "F_c_difference", "N", 0.05 * F, -F, F),
        freedom("viscous_asymmetry", "F_v_difference", "N s/m", 0.1 * F / v, -F / v, F / v),
        freedom("stribeck", "F_s", "N", 0.1 * F, 0.0, F),
        freedom("stribeck", "log_v_s", "1", 0.7, np.log(0.02), np.log(1.0), mean=np.log(0.1), off=np.log(0.1)),
        freedom("viscous_nonlinearity", "F_vv", "N s2/m2", 0.1 * F / v**2, -F / v**2, F / v**2),
        freedom("load_spring", "c", "N/m", 0.05 * F / scale["q"], -F / scale["q"], F / scale["q"]),
        freedom("friction_position", "F_q", "N/m", 0.05 * F / scale["q"], -F / scale["q"], F / scale["q"]),
        freedom("friction_drift", "F_t", "N/s", 0.05 * F / scale["t"], -F / scale["t"], F / scale["t"]),
        freedom("offset_drift", "F_0t", "N/s", 0.05 * F / scale["t"], -F / scale["t"], F / scale["t"]),
        freedom("load_friction", "mu", "kg", 0.05 * F / a, -F / a, F / a),
    )  # fmt: skip


def _equations() -> dict[str, tuple[str, ...]]:
    friction = ("offset", "coulomb_asymmetry", "viscous_asymmetry", "stribeck", "viscous_nonlinearity")
    others = ("load_spring", "friction_position", "friction_drift", "load_friction")
    found: dict[str, tuple[str, ...]] = {effect: ("torque",) for effect in friction + others}
    return found | {"offset_drift": ("sensor_current",)}


def _model(p: Mapping[str, np.ndarray], block: Block) -> np.ndarray:
    """(point, statistic): mean force in each bin of direction, speed, acceleration and side of the stroke."""
    x = block.inputs
    force = p["M"] * x["a"] + p["F_v"] * x["v"] + p["F_c"] * x["sign"]
    force = force + p["F_0"] + p["F_c_difference"] * x["sign"] ** 2 + p["F_v_difference"] * x["speed"]
    force = force + p["F_vv"] * x["square"] + p["c"] * x["q"] + p["F_q"] * x["place"]
    force = force + p["F_t"] * x["drift"] + p["F_0t"] * x["t"] + p["mu"] * x["push"]
    if np.any(p["F_s"] != 0):
        v_s = np.exp(p["log_v_s"])[..., None] * x["v_max"]
        bump = (np.exp(-((x["samples"] / v_s) ** 2)) * np.sign(x["samples"])).mean(axis=-1)
        force = force + p["F_s"] * bump
    return force


def experiments() -> tuple[Experiment, ...]:
    """Other speeds, pushes and lengths."""
    slow = {"v": 0.1, "speed": 0.1, "samples": 0.1, "square": 0.01, "a": 0.01, "push": 0.01}
    return (
        scaled("the same strokes ten times slower", **slow),
        scaled("the same speeds with a third of the acceleration", a=1.0 / 3.0, push=1.0 / 3.0),
        scaled("ten times as long", t=10.0, drift=10.0),
        scaled("the same speeds on a tenth of the stroke", q=0.1, place=0.1),
    )


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
