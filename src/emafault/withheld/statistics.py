"""What the generator looks at to tell how visible a truth is: statistics of one recording and their noise.

They are the generator's own, written apart from the diagnosis: sums of the residuals that the nominal parameters leave
in the phase, torque, position and bus equations, sorted by rotor angle, direction, speed and time. All are linear in
per-sample features, so that their noise covariance is exact; what two runs of the same physics differ by (switching)
is measured and added.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.ndimage import uniform_filter1d

from ..actuator.commands import command_positions
from ..actuator.parameters import ActuatorParameters, make_runs
from ..actuator.sensors import SensorNoise
from ..actuator.simulate import commanded_position, simulate, simulate_each, time_axis
from ..effects import EFFECTS
from .cases import Case, RecordingPlan
from .sums import ALPHA, CELLS, KINDS, PARTS, TIME_BINS, add_up, weights

COARSE = 2e-4  # s, shorter intervals are merged up to it
MEANS = ("phase_voltage", "phase_current", "rotor_speed", "bus_voltage")
START, SLOW, MARGIN = 0.05, 3.0, 0.01  # s, rad/s, s
MIN_VISITS = 10.0  # samples
LAG = 5e-3  # s, scatter of one sample's view of how late the current follows its reference
Unit = Mapping[str, Mapping[str, float]]


def simulate_plan(
    actuator: ActuatorParameters,
    plan: RecordingPlan,
    units: Sequence[Unit],
    faults: np.ndarray,
    band: np.ndarray | float = 1.0,
) -> dict[str, np.ndarray]:
    """Simulate one recording for a batch of units and (run, 6) faults, noise-free; ``band`` scales the hysteresis."""
    runs, command = runs_of(actuator, plan, units, faults)
    runs["hysteresis"] *= band
    return simulate(runs, command, plan.duration, plan.interval)


def simulate_plans(
    actuator: ActuatorParameters, plans: Sequence[RecordingPlan], states: Sequence[tuple[Unit, np.ndarray]]
) -> list[dict[str, np.ndarray]]:
    """Simulate every recording once, noise-free, each for its own unit and (6,) fault; signals with a run axis of 1."""
    made = [runs_of(actuator, plan, [unit], fault[None]) for plan, (unit, fault) in zip(plans, states)]
    records = [len(time_axis(plan.duration, plan.interval)) for plan in plans]
    found = simulate_each(
        np.concatenate([runs for runs, _ in made]), [c for _, c in made], [plan.interval for plan in plans], records
    )
    out = []
    for plan, (_, command), signals in zip(plans, made, found):
        time = time_axis(plan.duration, plan.interval)
        signals["commanded_position"] = commanded_position(command, actuator.control_period, time)
        out.append({name: values[None] for name, values in signals.items()})
    return out


def runs_of(
    actuator: ActuatorParameters, plan: RecordingPlan, units: Sequence[Unit], faults: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Records of RUN_DTYPE of a recording for a batch of units and (run, 6) faults, and its command (tick+1,), rad."""
    runs = make_runs(actuator, faults, theta_0=plan.theta_0)
    for row, unit in enumerate(units):
        for effect, values in unit.items():
            for name, value in values.items():
                runs[EFFECTS[effect].field(name)][row] = value
    return runs, command_positions(plan.command, plan.settings, plan.duration, actuator.control_period)


def trapezoid(x: np.ndarray) -> np.ndarray:
    """Nominal unit back-EMF at electrical angle x (rad)."""
    turns = x / (2.0 * np.pi) - 0.25
    return np.clip(np.abs(turns - np.floor(turns) - 0.5) * 12.0 - 3.0, -1.0, 1.0)


def coarser(
    plan: RecordingPlan, signals: Mapping[str, np.ndarray]
) -> tuple[RecordingPlan, Mapping[str, np.ndarray], int]:
    """Merge short recording intervals, for speed: the plan, its signals and how many intervals became one."""
    merged = int(COARSE / plan.interval + 1e-6)
    if merged < 2:
        return plan, signals, 1
    samples = signals["rotor_speed"].shape[1] // merged
    out = {}
    for name, values in signals.items():
        whole = values[:, : samples * merged]
        blocks = whole.reshape(len(whole), samples, merged, *whole.shape[2:])
        out[name] = blocks.mean(axis=2) if name in MEANS else blocks[:, :, -1]
    interval = merged * plan.interval
    return replace(plan, interval=interval, duration=samples * interval), out, merged


class View:
    """Statistics of one recording: means of residuals over cells of time, rotor angle, direction and speed.

    Every candidate is sorted by its own rotor angle; cells that the recording itself hardly visits are left out.
    """

    def __init__(
        self,
        actuator: ActuatorParameters,
        plan: RecordingPlan,
        case: Case,
        noise: SensorNoise,
        truth: Mapping[str, np.ndarray],
        merged: int = 1,
    ):
        self.actuator, self.plan, self.case = actuator, plan, case
        self.sigma = {c: getattr(noise, c) * scale for c, scale in case.noise_scale.items()}
        for channel in ("voltage", "current", "speed", "position", "bus_voltage"):
            self.sigma[channel] /= np.sqrt(merged)
        time = np.arange(1, len(truth["rotor_speed"][0]) + 1) * plan.interval
        self.time_bin = np.minimum((time / plan.duration * TIME_BINS).astype(int), TIME_BINS - 1)
        self.late = time > START
        self.reach = max(1, round(MARGIN / plan.interval))
        self.half_speed = 0.6 * float(np.max(np.abs(truth["rotor_speed"][0])))
        self.kinds = ["mismatch", "twist", "torque", "voltage_0", "voltage_1", "voltage_2"]
        if np.max(np.abs(truth["phase_current"][0])) < 0.5 * actuator.current_limit:  # else too wild a transient
            self.kinds += ["lag", "current_0", "current_1", "current_2"]
        if case.bus_voltage:
            self.kinds.append("bus")
        rows = weights(*self._visits(truth, 0))
        power = np.sum(rows**2, axis=1)
        self.count = np.sqrt(power)
        rows *= self._scale(power)[:, None]
        self.rows = {kind: rows[PARTS[kind]] for kind in self.kinds}
        self.factors: dict[str, np.ndarray] = {}

    def _visits(self, signals: Mapping[str, np.ndarray], run: int) -> tuple:
        """What ``sums.add_up`` and ``sums.weights`` ask of a run: where its samples are."""
        theta, speed = signals["rotor_angle"][run], signals["rotor_speed"][run]
        middle = theta - 0.5 * speed * self.plan.interval
        # break-away and standstill are left out: there a small cause decides when motion sets in
        still = uniform_filter1d(((np.abs(speed) < SLOW) | ~self.late).astype(float), 2 * self.reach + 1)
        some = (still < 1e-9).astype(float)
        return middle, np.ascontiguousarray(speed), some, self.time_bin, self.actuator.pole_pairs, self.half_speed

    def _scale(self, power: np.ndarray) -> np.ndarray:
        """Factors that count a cell's mean by the visits that the recording itself paid to it."""
        return (self.count**2 > MIN_VISITS) * self.count / (power + 0.5)

    def features(self, signals: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Per-sample features (run, time) of signals with a run axis."""
        a, plan = self.actuator, self.plan
        theta, speed, i = signals["rotor_angle"], signals["rotor_speed"], signals["phase_current"]
        before = np.concatenate([np.full((len(theta), 1), plan.theta_0), theta[:, :-1]], axis=1)
        rate, middle = (theta - before) / plan.interval, 0.5 * (theta + before)
        if self.case.end_current:
            slope = np.diff(signals["phase_current_end"], axis=1, prepend=0.0) / plan.interval
        else:
            slope = np.gradient(i, plan.interval, axis=1)
        first = trapezoid(a.pole_pairs * np.full((len(theta), 1, 1), plan.theta_0) - ALPHA)
        f_end = trapezoid(a.pole_pairs * theta[..., None] - ALPHA)
        f_before = np.concatenate([first, f_end[:, :-1]], axis=1)
        f = (f_end + f_before + 4.0 * trapezoid(0.5 * a.pole_pairs * (theta + before)[..., None] - ALPHA)) / 6.0
        R = a.resistance * (1.0 + a.copper_coefficient * plan.fault[5])
        residual = signals["phase_voltage"] - R * i - a.inductance * slope - a.back_emf * f * speed[..., None]
        turning = a.back_emf * np.sum(f * i, axis=2)
        torque = turning - a.inertia * np.gradient(speed, plan.interval, axis=1)
        torque -= a.viscous_friction * speed + a.coulomb_friction * np.tanh(speed)
        motor = (theta - plan.theta_0) / a.gear_ratio
        # how late the current follows the speed loop: its residual along the reference's own rate of change
        wanted = a.gear_ratio * a.position_gain * (signals["commanded_position"] - signals["output_position"])
        error = np.clip(wanted, -a.speed_limit, a.speed_limit) - speed
        asked = a.speed_gain * np.gradient(error, plan.interval, axis=1) + a.speed_integral_gain * error
        change = np.gradient(turning, plan.interval, axis=1) / (2.0 * a.back_emf)
        asked, change = _smooth(asked, self.reach), _smooth(change, self.reach)
        bend = np.gradient(asked, plan.interval, axis=1)
        out = {
            "mismatch": speed - rate,
            "twist": motor - signals["output_position"],
            "torque": torque,
            "lag": (asked - change) * bend / (np.mean(bend**2, axis=1, keepdims=True) + 1e-9),
            "bus": signals["bus_voltage"],
        }
        electrical = np.exp(1j * a.pole_pairs * middle)
        carried = turning / (2.0 * a.back_emf)
        for j in range(3):
            # which phases carry the current, apart from how much of it there is
            out[f"current_{j}"] = i[..., j] - _block(electrical * np.exp(-1j * ALPHA[j])) * carried
            out[f"voltage_{j}"] = residual[..., j]
        return out

    def statistics(self, signals: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """(run, statistic) of each kind."""
        features = self.features(signals)
        ordered = np.stack([features[kind] for kind in KINDS], axis=1)
        values = np.zeros((len(ordered), CELLS))
        for run in range(len(ordered)):
            power = np.zeros(CELLS)
            add_up(*self._visits(signals, run), ordered[run], values[run], power)
            values[run] *= self._scale(power)
        return {kind: values[:, PARTS[kind]] for kind in self.kinds}

    def prepare(self, scatter: Mapping[str, float]) -> None:
        """Noise covariance of each kind; ``scatter`` is the variance from switching (the same physics twice)."""
        a, s, dt = self.actuator, self.sigma, self.plan.interval
        slope = a.inductance / dt * (s["current_end"] if self.case.end_current else a.hysteresis)
        level = {  # variance of a sample, and that of a quantity differenced between samples
            "mismatch": (s["speed"] ** 2, (s["angle"] / dt) ** 2),
            "twist": (s["position"] ** 2, 0.0),
            "torque": (2.0 * (a.back_emf * s["current"]) ** 2, (a.inertia * s["speed"] / dt) ** 2),
            "bus": (s["bus_voltage"] ** 2, 0.0),
            "lag": (LAG**2, 0.0),
        }
        for j in range(3):
            level[f"current_{j}"] = (s["current"] ** 2, 0.0)
            white = s["voltage"] ** 2 + (a.resistance * s["current"]) ** 2 + (a.back_emf * s["speed"]) ** 2
            level[f"voltage_{j}"] = (white, slope**2)
        for kind, rows in self.rows.items():
            white, differenced = level[kind]
            covariance = white * (rows @ rows.T)
            if differenced > 0.0:
                step = np.diff(rows, axis=1, append=0.0)
                covariance += differenced * (step @ step.T)
            floor = scatter[kind] + 1e-9 * np.trace(covariance) / len(covariance) + 1e-30
            self.factors[kind] = cholesky(covariance + np.diag(np.full(len(covariance), floor)), lower=True)

    def whiten(self, statistics: Mapping[str, np.ndarray]) -> np.ndarray:
        """Differences of statistics in noise units, (run, statistic)."""
        parts = []
        for kind, factor in self.factors.items():
            parts.append(solve_triangular(factor, statistics[kind].T, lower=True, check_finite=False).T)
        return np.concatenate(parts, axis=1)


def less(statistics: Mapping[str, np.ndarray], base: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Statistics less those of one run."""
    return {kind: values - base[kind] for kind, values in statistics.items()}


def _block(wave: np.ndarray) -> np.ndarray:
    """First harmonics of a six-step current where its phase's electrical angle is that of ``wave`` (complex)."""
    wave_2 = wave * wave
    wave_5 = wave * wave_2 * wave_2
    orders = ((1, wave), (5, wave_5), (7, wave_5 * wave_2))
    return sum((4.0 / (n * np.pi) * np.cos(n * np.pi / 6.0) * w.imag for n, w in orders), np.zeros(wave.shape))


def _smooth(x: np.ndarray, reach: int) -> np.ndarray:
    """Moving mean over 2 reach + 1 samples of (run, time)."""
    return uniform_filter1d(x, 2 * reach + 1, axis=1)
