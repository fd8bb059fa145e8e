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

ALPHA = np.arange(3) * 2.0 * np.pi / 3.0
TIME_BINS, ANGLE_BINS = 12, 24
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
    return np.clip(np.abs((x / np.pi - 0.5) % 2.0 - 1.0) * 6.0 - 3.0, -1.0, 1.0)


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


class Sums:
    """Weighted sums over samples: every row of ``weight`` (cell, time), or one weight (time,) sorted into cells."""

    def __init__(self, weight: np.ndarray, cell: np.ndarray | None = None, cells: int = 0):
        self.weight, self.cell, self.cells = weight, cell, cells

    def of(self, values: np.ndarray) -> np.ndarray:
        """(cell,) sums of a feature (time,)."""
        if self.cell is None:
            return self.weight @ values
        return np.bincount(self.cell, self.weight * values, self.cells)

    def power(self) -> np.ndarray:
        """(cell,) sums of squared weights."""
        if self.cell is None:
            return np.sum(self.weight**2, axis=1)
        return np.bincount(self.cell, self.weight**2, self.cells)

    def dense(self) -> np.ndarray:
        """(cell, time) weights."""
        if self.cell is None:
            return self.weight
        return (self.cell == np.arange(self.cells)[:, None]) * self.weight


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
        self.counts, self.rows = {}, {}
        for kind, sums in self._sums(truth, 0).items():
            rows = np.concatenate([part.dense() for part in sums])
            self.counts[kind] = np.sqrt(np.sum(rows**2, axis=1))
            self.rows[kind] = rows * self._scale(kind, np.sum(rows**2, axis=1))[:, None]
        self.factors: dict[str, np.ndarray] = {}

    def _sums(self, signals: Mapping[str, np.ndarray], run: int) -> "dict[str, list[Sums]]":
        """Which samples each statistic adds up, with what weight."""
        theta, speed = signals["rotor_angle"][run], signals["rotor_speed"][run]
        middle = theta - 0.5 * speed * self.plan.interval
        forward, fast = speed > 0.0, np.abs(speed) > self.half_speed
        # break-away and standstill are left out: there a small cause decides when motion sets in
        still = uniform_filter1d(((np.abs(speed) < SLOW) | ~self.late).astype(float), 2 * self.reach + 1)
        moving = still < 1e-9
        some = moving.astype(float)
        thirds = self.time_bin * 3 // TIME_BINS + 3 * forward
        turn = np.exp(1j * middle)
        turn_8 = _squared(turn, 3)
        turn_24 = turn_8 * turn_8 * turn_8
        turn_72 = turn_24 * turn_24 * turn_24
        # orders 72, 144, 24 and 1
        waves = [g * some for wave in (turn_72, turn_72 * turn_72, turn_24, turn) for g in (wave.real, wave.imag)]
        electrical = np.exp(1j * self.actuator.pole_pairs * middle)
        in_time = Sums(some, self.time_bin, TIME_BINS)
        sums = {
            "bus": [Sums(np.ones_like(speed), self.time_bin, TIME_BINS)],
            "mismatch": [in_time],
            "twist": [Sums(some, thirds, 6)],
            "torque": [in_time, Sums(np.array(waves))],
            "lag": [Sums(some[None])],
        }
        for j in range(3):
            x = (self.actuator.pole_pairs * middle - ALPHA[j]) % (2.0 * np.pi)
            cell = np.minimum((x / (2.0 * np.pi) * ANGLE_BINS).astype(int), ANGLE_BINS - 1)
            cell += ANGLE_BINS * forward + 2 * ANGLE_BINS * fast
            f = trapezoid(x)
            swing = [f * speed * turn.real * some, f * speed * turn.imag * some]
            wave = electrical * np.exp(-1j * ALPHA[j])
            wave_2, wave_5 = wave * wave, wave * _squared(wave, 2)
            orders = [np.ones_like(x), *(g for w in (wave, wave_2, wave_5, wave_5 * wave_2) for g in (w.real, w.imag))]
            both = np.array([o * some * way for way in (forward, ~forward) for o in orders])
            sums[f"current_{j}"] = [Sums(both)]
            sign = np.sign(np.where(np.abs(f) > 0.9, f * speed, 0.0)) * some
            sums[f"voltage_{j}"] = [
                Sums(some, cell, 4 * ANGLE_BINS),
                Sums(sign, self.time_bin, TIME_BINS),
                Sums(np.array(swing)),
            ]
        return {kind: sums[kind] for kind in self.kinds}

    def _scale(self, kind: str, power: np.ndarray) -> np.ndarray:
        """Factors that count a cell's mean by the visits that the recording itself paid to it."""
        count = self.counts[kind]
        return (count**2 > MIN_VISITS) * count / (power + 0.5)

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
        for j in range(3):
            # which phases carry the current, apart from how much of it there is
            out[f"current_{j}"] = i[..., j] - _block(a.pole_pairs * middle - ALPHA[j]) * turning / (2.0 * a.back_emf)
            out[f"voltage_{j}"] = residual[..., j]
        return out

    def statistics(self, signals: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """(run, statistic) of each kind."""
        features = self.features(signals)
        out: dict[str, list[np.ndarray]] = {kind: [] for kind in self.kinds}
        for run in range(len(signals["rotor_speed"])):
            for kind, sums in self._sums(signals, run).items():
                values = np.concatenate([part.of(features[kind][run]) for part in sums])
                power = np.concatenate([part.power() for part in sums])
                out[kind].append(self._scale(kind, power) * values)
        return {kind: np.array(values) for kind, values in out.items()}

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


def _squared(x: np.ndarray, times: int) -> np.ndarray:
    """x squared again and again."""
    for _ in range(times):
        x = x * x
    return x


def less(statistics: Mapping[str, np.ndarray], base: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Statistics less those of one run."""
    return {kind: values - base[kind] for kind, values in statistics.items()}


def _block(x: np.ndarray) -> np.ndarray:
    """First harmonics of a six-step current at electrical angle x (rad)."""
    out = np.zeros_like(x)
    for n in (1, 5, 7):
        out += 4.0 / (n * np.pi) * np.cos(n * np.pi / 6.0) * np.sin(n * x)
    return out


def _smooth(x: np.ndarray, reach: int) -> np.ndarray:
    """Moving mean over 2 reach + 1 samples of (run, time)."""
    return uniform_filter1d(x, 2 * reach + 1, axis=1)
