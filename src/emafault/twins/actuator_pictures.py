"""What the report shows of the actuator around the region where the simulator is most wrong."""

from dataclasses import dataclass

import numpy as np

from ..actuator.motor import AXIS, TWO_PI
from ..gap.diagnose import Diagnosis
from .actuator import ActuatorTwin
from .actuator_layout import EQUATIONS, PHASE_EQUATIONS, cells_of
from .actuator_statistics import compute

BINS = 40
_RESIDUAL = {
    "electrical": ("V", "voltage less R i, L di/dt and back-EMF"),
    "sensor_current": ("A", "sum of the phase currents"),
    "sensor_voltage": ("V", "sum of the three voltage balances"),
    "sensor_speed": ("rad/s", "speed less the rate of the angle"),
    "torque": ("N m", "motor torque less inertia and friction"),
    "position": ("rad", "user shaft less rotor angle over the ratio"),
    "bus": ("V", "bus voltage less its nominal"),
    "control": ("A", "pair current less the regulator's reference, over 10 ms"),
}


@dataclass(frozen=True)
class Region:
    """One equation of one recording: residual along a coordinate, and signals of a stretch of time.

    ``curves`` maps measured, recalibrated and after to (bin,) means; ``error`` is the measured means' standard error.
    ``traces`` maps a signal's label to the same three as (time,) arrays.
    """

    recording: str
    equation: str
    statistic: str
    coordinate: str
    residual: str
    centre: np.ndarray
    curves: dict[str, np.ndarray]
    error: np.ndarray
    time: np.ndarray
    traces: dict[str, dict[str, np.ndarray]]


def worst_region(diagnosis: Diagnosis) -> Region | None:
    """The region that the null fit misses most, in the recording where it is missed most; None where nothing is."""
    twin, problem = diagnosis.twin, diagnosis.explore
    families = diagnosis.found.regions
    if not isinstance(twin, ActuatorTwin) or not families:
        return None
    worst = families[0]
    z = np.abs(problem.observed - diagnosis.found.null.prediction) / problem.deviations()
    own = [
        m
        for m, c in enumerate(problem.cells)
        if (c.equation, c.label, c.along) == (worst.equation, worst.label, worst.along)
    ]
    name = problem.cells[max(own, key=lambda m: z[m])].recording
    points = {"recalibrated": diagnosis.found.null.values}
    if diagnosis.decision.verdict in ("explained", "group", "partly"):
        points["after"] = diagnosis.found.candidates[0].point.values
    brought = twin._brought[name]
    runs = {rung: twin._runs(values[None, :], name)[0] for rung, values in points.items()}
    signals = twin.simulated(name, list(runs.values()))
    simulated = dict(zip(runs, signals, strict=True))
    computed = {rung: compute(brought.nominal, simulated[rung], keep=True) for rung in runs}
    row = EQUATIONS.index(worst.equation)
    alike = [m for m, c in enumerate(cells_of(name)) if (c.equation, c.along) == (worst.equation, worst.along)]
    counts = np.any(brought.computed.regressors[alike] != 0.0, axis=0)
    theta = brought.signals["rotor_angle"]
    x, label = _coordinate(twin, worst.equation, worst.along, worst.label, brought.signals, brought.nominal.interval)
    low, high = _span(x, worst.along)
    edges = np.linspace(low, high, BINS + 1)
    whole = worst.along in ("rotor_angle", "order")  # along an angle all samples are shown, else those that count

    def binned(residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        where = np.ones(len(theta), bool) if whole else counts.copy()
        where[:2] = False
        place = np.clip(np.digitize(x[where], edges) - 1, 0, BINS - 1)
        number = np.bincount(place, minlength=BINS).astype(float)
        mean = np.bincount(place, residual[where], BINS) / np.maximum(number, 1)
        square = np.bincount(place, residual[where] ** 2, BINS) / np.maximum(number, 1)
        error = np.sqrt(np.maximum(square - mean**2, 0.0) / np.maximum(number - 1, 1))
        mean[number < 5] = np.nan
        return mean, error

    mean, error = binned(brought.computed.residual[row])
    curves = {"measured": mean}
    for rung, c in computed.items():
        curves[rung] = binned(c.residual[row])[0]
    units, text = _RESIDUAL["electrical" if worst.equation in PHASE_EQUATIONS else worst.equation]
    gap = brought.computed.residual[row] - computed["recalibrated"].residual[row]
    stretch = _stretch(gap * counts, brought.nominal.interval, theta)
    traces = {
        label_: {
            "measured": pick(brought.signals)[stretch],
            **{rung: pick(signals)[stretch] for rung, signals in simulated.items()},
        }
        for label_, pick in _signals(twin, worst.equation).items()
    }
    time = brought.nominal.interval * (np.arange(len(theta)) + 1)
    return Region(
        recording=name,
        equation=worst.equation,
        statistic=worst.label,
        coordinate=label,
        residual=f"{text} ({units})",
        centre=0.5 * (edges[1:] + edges[:-1]),
        curves=curves,
        error=error,
        time=time[stretch],
        traces=traces,
    )


def _coordinate(
    twin: ActuatorTwin, equation: str, along: str, label: str, signals: dict, interval: float
) -> tuple[np.ndarray, str]:
    """(time,) coordinate of a statistic and its axis label."""
    theta, current = signals["rotor_angle"], signals["phase_current"]
    phase = PHASE_EQUATIONS.index(equation) if equation in PHASE_EQUATIONS else 0
    if along == "rotor_angle" and ("cos" in label or "sin" in label):
        return np.rad2deg(theta % TWO_PI), "rotor angle (deg)"
    if along in ("rotor_angle", "order") and equation in PHASE_EQUATIONS:
        angle = (twin.actuator.pole_pairs * theta - AXIS[phase]) % TWO_PI
        return np.rad2deg(angle), f"electrical angle of phase {'abc'[phase]} (deg)"
    if along == "order":
        order = next((int(w) for w in label.split() if w.isdigit()), 1)
        return np.rad2deg((order * theta) % TWO_PI), f"{order} x rotor angle (deg)"
    if along == "rotor_angle":
        return signals["output_position"], "user shaft (rad)"
    if along == "current":
        if equation in PHASE_EQUATIONS:
            return current[:, phase], f"current of phase {'abc'[phase]} (A)"
        return 0.5 * np.abs(current).sum(1), "current level (A)"
    if along == "time":
        return interval * (np.arange(len(theta)) + 1), "time (s)"
    return _smooth(np.gradient(theta, interval), interval), "rotor speed (rad/s)"


def _smooth(values: np.ndarray, interval: float) -> np.ndarray:
    half = max(1, round(1e-3 / interval))
    return np.convolve(np.pad(values, half, mode="edge"), np.ones(2 * half + 1) / (2 * half + 1), "valid")


def _span(x: np.ndarray, along: str) -> tuple[float, float]:
    if along in ("rotor_angle", "order") and np.max(x) > 180.0:
        return 0.0, 360.0
    low, high = np.quantile(x, [0.002, 0.998])
    return float(low), float(max(high, low + 1e-9))


def _stretch(gap: np.ndarray, interval: float, theta: np.ndarray) -> slice:
    """The stretch of time with the largest squared gap: 60 ms, or 10 to 200 ms for one mechanical turn."""
    travel = float(np.ptp(theta)) / (interval * len(theta))
    length = int(np.clip(TWO_PI / max(travel, 1e-3), 0.02, 0.15) / interval)
    length = min(length, len(gap) - 1)
    power = np.convolve(gap**2, np.ones(length), "valid")
    start = int(np.argmax(power))
    return slice(start, start + length)


def _signals(twin: ActuatorTwin, equation: str) -> dict:
    """Label -> function that picks a signal: the ones that stand in an equation."""
    poles, ratio = twin.actuator.pole_pairs, twin.actuator.gear_ratio

    def pair(s: dict) -> np.ndarray:
        return 0.5 * np.abs(s["phase_current"]).sum(1)

    speed = {"rotor speed (rad/s)": lambda s: s["rotor_speed"]}
    if equation in PHASE_EQUATIONS:
        j = PHASE_EQUATIONS.index(equation)
        return {
            f"voltage of phase {'abc'[j]} (V)": lambda s: s["phase_voltage"][:, j],
            f"current of phase {'abc'[j]} (A)": lambda s: s["phase_current"][:, j],
        }
    if equation == "sensor_voltage":
        return {"sum of the voltages (V)": lambda s: s["phase_voltage"].sum(1), **speed}
    if equation == "sensor_current":
        return {"sum of the currents (A)": lambda s: s["phase_current"].sum(1), "current level (A)": pair}
    if equation == "bus":
        return {"bus voltage (V)": lambda s: s["bus_voltage"], "current level (A)": pair}
    if equation == "position":
        return {
            "user shaft less rotor (mrad)": lambda s: (
                1e3 * (s["output_position"] - (s["rotor_angle"] - s["rotor_angle"][0]) / ratio)
            ),
            **speed,
        }
    if equation == "sensor_speed":
        return {**speed, "electrical angle (rad)": lambda s: (poles * s["rotor_angle"]) % TWO_PI}
    return {"current level (A)": pair, **speed}
