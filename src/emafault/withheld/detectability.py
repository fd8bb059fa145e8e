"""How visible a truth is: squared distances in noise units between what a bench shows and what other causes would show.

Written apart from the diagnosis, with statistics of its own: sums of the residuals that the nominal parameters leave in
the phase, torque, position and bus equations, sorted by rotor angle, direction, speed and time. All are linear in
per-sample features, so that their noise covariance is exact; what two runs of the same physics differ by (switching) is
measured and added. Distances are marginal over the nuisances: unit tolerances, soak temperatures and faults.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular
from scipy.ndimage import uniform_filter1d
from scipy.optimize import lsq_linear

from ..actuator.commands import command_positions
from ..actuator.parameters import ActuatorParameters, make_runs
from ..actuator.sensors import SensorNoise
from ..actuator.simulate import simulate
from ..effects import EFFECTS
from .cases import Case, RecordingPlan

ALPHA = np.arange(3) * 2.0 * np.pi / 3.0
TIME_BINS, ANGLE_BINS = 12, 24
LATTICE = 1e6  # squared distance by which rounded values differ from unrounded ones: one look at them tells
START, SLOW, MARGIN = 0.05, 3.0, 0.01  # s, rad/s, s
MIN_VISITS = 10.0  # samples
LAG = 5e-3  # s, scatter of one sample's view of how late the current follows its reference
PLAIN = 5e3  # above it a squared distance to the nominal model is not refined
SCATTER = 2.0  # half would be one run's variance; derivatives carry the scatter of several
STRIDE = 1.5  # largest step of a nuisance
FAR = 5.0  # no nuisance further than this, in prior standard deviations
SOAK = 0.5  # K, prior of the soak temperature
FAULT_PRIOR = np.array([0.05, 0.05, 0.05, 0.1, 0.1])
FAULT_SCALE = np.array([0.1, 0.1, 0.1, 0.2, 0.2, 120.0])  # ranges, to add unlike components up
Unit = Mapping[str, Mapping[str, float]]


def simulate_plan(
    actuator: ActuatorParameters,
    plan: RecordingPlan,
    units: Sequence[Unit],
    faults: np.ndarray,
    band: np.ndarray | float = 1.0,
) -> dict[str, np.ndarray]:
    """Simulate one recording for a batch of units and (run, 6) faults, noise-free; ``band`` scales the hysteresis."""
    runs = make_runs(actuator, faults, theta_0=plan.theta_0)
    runs["hysteresis"] *= band
    for row, unit in enumerate(units):
        for effect, values in unit.items():
            for name, value in values.items():
                runs[EFFECTS[effect].field(name)][row] = value
    command = command_positions(plan.command, plan.settings, plan.duration, actuator.control_period)
    return simulate(runs, command, plan.duration, plan.interval)


def trapezoid(x: np.ndarray) -> np.ndarray:
    """Nominal unit back-EMF at electrical angle x (rad)."""
    return np.clip(np.abs((x / np.pi - 0.5) % 2.0 - 1.0) * 6.0 - 3.0, -1.0, 1.0)


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

    def __init__(self, actuator: ActuatorParameters, plan: RecordingPlan, case: Case, noise: SensorNoise, truth):
        self.actuator, self.plan, self.case = actuator, plan, case
        self.sigma = {c: getattr(noise, c) * scale for c, scale in case.noise_scale.items()}
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
        waves = [g(order * middle) * some for order in (72.0, 144.0, 24.0, 1.0) for g in (np.cos, np.sin)]
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
            swing = [f * speed * np.cos(middle) * some, f * speed * np.sin(middle) * some]
            orders = [np.ones_like(x), *(g(n * x) for n in (1, 2, 5, 7) for g in (np.cos, np.sin))]
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


def _less(statistics: Mapping[str, np.ndarray], base: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
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


@dataclass(frozen=True)
class Detectability:
    """Squared distances from the truth, and the best that can be known of the faults."""

    nominal: float  # to the nominal model
    members: dict[str, float]  # per effect: to the same truth without it, the others free
    fault_sd: list[
        list[float] | None
    ]  # per recording: fault vector's error in units of the ranges, effects known in kind


class Detector:
    """Distances of one case. Everything is measured from the *base*: the case's own unit and faults without any effect.

    A nuisance is counted in units of its prior's standard deviation.
    """

    def __init__(
        self,
        case: Case,
        actuator: ActuatorParameters,
        noise: SensorNoise,
        truth: Sequence[Mapping[str, np.ndarray]],
    ):
        self.case, self.actuator = case, actuator
        self.unit = {k: dict(v) for k, v in case.tolerances.items()}
        self.tolerances = [
            (e.id, n, p.tolerance * abs(p.nominal))
            for e in EFFECTS.values()
            for n, p in e.parameters.items()
            if e.kind == "calibration" and p.tolerance > 0.0
        ]
        first = len(self.tolerances)
        owner: dict[str, int] = {}
        self.fault_columns: list[list[int]] = []  # per recording: N, xi (none in a healthy one), soak temperature
        for m, plan in enumerate(case.recordings):
            at: list[int] = []
            if plan.health != "healthy":
                start = owner.setdefault(plan.health if plan.health == "unknown" else f"{m}", first + 5 * len(owner))
                at = list(range(start, start + 5))
            self.fault_columns.append(at)
        soak = first + 5 * len(owner)
        for m, at in enumerate(self.fault_columns):
            at.append(soak + m)
        self.prior = np.array(
            [sd for _, _, sd in self.tolerances] + [*FAULT_PRIOR] * len(owner) + [SOAK] * len(case.recordings)
        )
        self.views: list[View] = []
        self.base: list[dict[str, np.ndarray]] = []
        blocks, repeats, deltas = [], [], []
        for m, plan in enumerate(case.recordings):
            view = View(actuator, plan, case, noise, truth[m])
            moved = [np.zeros(len(self.prior)), np.zeros(len(self.prior))]
            columns = [*range(first), *self.fault_columns[m]]
            for column in columns:
                moved.append(np.zeros(len(self.prior)))
                moved[-1][column] = self._step(column, soak)
            states = [self._state(m, x, {}) for x in moved]
            band = np.ones(len(states))
            band[1] += 1e-4  # the same physics, another switching pattern
            signals = simulate_plan(actuator, plan, [u for u, _ in states], np.array([f for _, f in states]), band)
            statistics = view.statistics(signals)
            view.prepare({n: SCATTER * float(np.mean((s[1] - s[0]) ** 2)) for n, s in statistics.items()})
            base = {n: s[:1] for n, s in statistics.items()}
            shifts = view.whiten({n: s[1:] - base[n] for n, s in statistics.items()})
            block = np.zeros((shifts.shape[1], len(self.prior)))
            for column, row in zip(columns, shifts[1:]):
                block[:, column] = row / self._step(column, soak)
            self.views.append(view)
            self.base.append(base)
            blocks.append(block)
            repeats.append(shifts[0])
            deltas.append(view.whiten(_less(view.statistics(truth[m]), base))[0])
        self.delta = np.concatenate(deltas)
        self.jacobian = np.concatenate(blocks)
        self.normal = cho_factor(np.eye(len(self.prior)) + self.jacobian.T @ self.jacobian)
        self.repeat = self.squared(np.concatenate(repeats))
        self.lattice = LATTICE if "speed_quantisation" in case.effects else 0.0

    def _step(self, column: int, soak: int) -> float:
        """Finite-difference step of a nuisance, in prior standard deviations."""
        if column < len(self.tolerances):
            return 1.5
        return 6.0 if column >= soak else 0.4

    def _state(self, m: int, x: np.ndarray, effects: Unit) -> tuple[dict[str, dict[str, float]], np.ndarray]:
        """Unit and fault vector of a recording at nuisances x with effects added."""
        unit = {k: dict(v) for k, v in self.unit.items()}
        for (effect, name, sd), value in zip(self.tolerances, x):
            if value != 0.0:
                nominal = abs(unit[effect][name])
                unit[effect][name] = max(0.05 * nominal, unit[effect][name] + sd * float(value))
        for effect, values in effects.items():
            unit[effect] = {**unit.get(effect, {}), **values}
        fault = np.array(self.case.recordings[m].fault)
        at = self.fault_columns[m]
        fault[6 - len(at) :] += self.prior[at] * x[at]
        fault[:3] = np.clip(fault[:3], -0.3, 0.6)
        return unit, fault

    def shift(self, x: np.ndarray | None, effects: Unit) -> np.ndarray:
        """Whitened shift of all statistics from the base, (statistic,)."""
        x = np.zeros(len(self.prior)) if x is None else x
        out = []
        for m, (view, base) in enumerate(zip(self.views, self.base)):
            unit, fault = self._state(m, x, effects)
            signals = simulate_plan(self.actuator, view.plan, [unit], fault[None])
            out.append(view.whiten(_less(view.statistics(signals), base))[0])
        return np.concatenate(out)

    def squared(self, shift: np.ndarray) -> float:
        """Squared length of a whitened shift, nuisances marginalised to first order."""
        inner = self.jacobian.T @ shift
        return float(shift @ shift - inner @ cho_solve(self.normal, inner))

    def columns(
        self, effect: str, at: np.ndarray, x: np.ndarray | None = None, there: np.ndarray | None = None
    ) -> np.ndarray:
        """Derivatives of all statistics by an effect's coordinates about ``at``, (statistic, coordinate)."""
        coordinates = COORDINATES[effect]
        if there is None:
            there = self.shift(x, {effect: coordinates.values(at)})
        columns = []
        for c, step in enumerate(coordinates.steps(at)):
            moved = at.copy()
            moved[c] += step
            columns.append((self.shift(x, {effect: coordinates.values(moved)}) - there) / step)
        return np.stack(columns, 1)

    def distance_to(self, effect: str | None, iterations: int = 4) -> float:
        """Squared distance from the truth to the nearest point of a model with one effect (None: the nominal model).

        Gauss-Newton on effect and nuisances with the nuisances' derivatives kept; what two runs of the same physics
        differ by is taken off.
        """
        lattice = 0.0 if effect == "speed_quantisation" else self.lattice
        coordinates = COORDINATES[effect] if effect and effect != "speed_quantisation" else None
        x = np.zeros(len(self.prior))
        at = coordinates.start.copy() if coordinates else np.zeros(0)

        def predicted(x: np.ndarray, at: np.ndarray) -> np.ndarray:
            return self.shift(x, {coordinates.effect: coordinates.values(at)} if coordinates else {})

        here = predicted(x, at) if coordinates else np.zeros_like(self.delta)
        cost = float(np.sum((self.delta - here) ** 2))
        for _ in range(iterations):
            design = self.jacobian
            if coordinates:
                design = np.concatenate([design, self.columns(coordinates.effect, at, x, here)], 1)
            information = design.T @ design
            information[: len(x), : len(x)] += np.eye(len(x))
            gradient = design.T @ (self.delta - here)
            gradient[: len(x)] -= x
            low, high = np.maximum(-FAR - x, -STRIDE), np.minimum(FAR - x, STRIDE)
            if coordinates:
                low, high = np.r_[low, coordinates.low - at], np.r_[high, coordinates.high - at]
            step = _bounded(information, gradient, low, high)
            tries = [step, 0.5 * step, 0.2 * step]
            if coordinates:  # the effect alone, for derivatives by nuisances carry scatter too
                alone = np.zeros(len(step))
                own = slice(len(x), None)
                alone[own] = _bounded(information[own, own], gradient[own], low[own], high[own])
                tries.insert(0, alone)
            found = []
            for move in tries:
                new_x, new_at = x + move[: len(x)], at + move[len(x) :]
                there = predicted(new_x, new_at)
                found.append((float(np.sum((self.delta - there) ** 2) + new_x @ new_x), new_x, new_at, there))
                if len(found) > 1 + bool(coordinates) and min(f[0] for f in found) < cost:
                    break
            new_cost, new_x, new_at, there = min(found, key=lambda f: f[0])
            if not new_cost < cost:
                break
            gain, (x, at, here, cost) = cost - new_cost, (new_x, new_at, there, new_cost)
            if gain < 0.5:
                break
        return max(0.0, min(cost - self.repeat, self._tolerance_cost(effect))) + lattice

    def _tolerance_cost(self, effect: str | None) -> float:
        """Squared distance at which the unit's tolerances alone explain a truth of calibration effects."""
        others = [e for e in self.case.effects if e != effect]
        if not others or any(EFFECTS[e].kind != "calibration" for e in others):
            return np.inf
        cost = 0.0
        for e, name, sd in self.tolerances:
            if e in others:
                cost += ((self.case.effects[e][name] - self.unit[e][name]) / sd) ** 2
        return cost

    def linear_distance(self, shift: np.ndarray, design: np.ndarray) -> float:
        """Squared distance from a shift to the span of some columns, nuisances marginalised, all to first order."""
        inner = self.jacobian.T @ design
        metric = design.T @ design - inner.T @ cho_solve(self.normal, inner)
        cross = design.T @ shift - inner.T @ cho_solve(self.normal, self.jacobian.T @ shift)
        return self.squared(shift) - float(cross @ np.linalg.pinv(metric, rcond=1e-10, hermitian=True) @ cross)

    def linear_rival(self, effect: str) -> float:
        """First-order squared distance from the truth to an effect: quick, and too large for strong truths."""
        if effect == "speed_quantisation":
            return self.squared(self.delta) + self.lattice
        return self.linear_distance(self.delta, self.columns(effect, COORDINATES[effect].start)) + self.lattice

    def detectability(self) -> Detectability:
        """Distances that go into the key."""
        effects = [e for e in self.case.effects if e != "speed_quantisation"]
        nominal = min(self.squared(self.delta), self._tolerance_cost(None)) + self.lattice
        if 5.0 < nominal < PLAIN:
            nominal = self.distance_to(None, 3)
        members = {e: LATTICE for e in self.case.effects if e not in effects}
        design = {e: self.columns(e, COORDINATES[e].point(self.case.effects[e])) for e in effects}
        for effect in effects:
            others = [e for e in effects if e != effect]
            if not others:
                members[effect] = max(0.0, nominal - self.lattice)
                continue
            rest = self.delta - self.shift(None, {e: self.case.effects[e] for e in others})
            distance = self.linear_distance(rest, np.concatenate([design[e] for e in others], 1))
            members[effect] = max(0.0, distance - self.repeat)
        return Detectability(nominal, members, self._fault_sd(list(design.values())))

    def _fault_sd(self, design: Sequence[np.ndarray]) -> list[list[float] | None]:
        """Standard deviations of the fault vectors with effects fitted, each component in units of its range."""
        columns = [g / np.maximum(np.linalg.norm(g, axis=0), 1e-9) for g in design]
        wide = np.concatenate([self.jacobian, *columns], 1)
        information = wide.T @ wide
        information[: len(self.prior), : len(self.prior)] += np.eye(len(self.prior))
        covariance = np.linalg.pinv(information, rcond=1e-12, hermitian=True)
        sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))[: len(self.prior)] * self.prior
        return [
            [float(sd[c] / scale) for c, scale in zip(at, FAULT_SCALE)] if len(at) == 6 else None
            for at in self.fault_columns
        ]


def _bounded(information: np.ndarray, gradient: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Minimum of a quadratic within bounds."""
    size = np.sqrt(np.diag(information)) + 1e-12
    root = cholesky(information / np.outer(size, size) + 1e-10 * np.eye(len(size)))
    target = solve_triangular(root, gradient / size, trans=1)
    return lsq_linear(root, target, bounds=(low * size - 1e-12, high * size + 1e-12)).x / size


class Coordinates:
    """Smooth coordinates in which an effect is fitted: its parameters, or what replaces them where singular."""

    def __init__(self, effect: str):
        self.effect = effect
        parameters = EFFECTS[effect].parameters
        self.names = [n for n in parameters if (effect, n) != ("self_heating", "Rth")]
        chosen = [parameters[n] for n in self.names]
        self.low = np.array([min(p.low, p.nominal) for p in chosen])
        self.high = np.array([max(p.high, p.nominal) for p in chosen])
        self.off = np.array([p.nominal for p in chosen])
        self.start = self.off.copy()
        if effect == "dynamic_eccentricity":  # d cos psi, d sin psi
            self.low, self.high, self.off = np.full(2, -0.06), np.full(2, 0.06), np.zeros(2)
            self.start = self.off.copy()
        elif effect == "stribeck":
            self.low, self.start = np.array([0.0, 1.0]), np.array([0.005, 6.0])
        elif effect == "compliance":
            self.low, self.start = np.array([2e3, 200.0]), np.array([1e4, 300.0])

    def values(self, at: np.ndarray) -> dict[str, float]:
        """Parameters of the effect at these coordinates."""
        if self.effect == "dynamic_eccentricity":
            return {"d": float(np.hypot(*at)), "psi": float(np.arctan2(at[1], at[0]))}
        return {n: float(v) for n, v in zip(self.names, at)}

    def point(self, values: Mapping[str, float]) -> np.ndarray:
        """Coordinates of parameters."""
        if self.effect == "dynamic_eccentricity":
            return values["d"] * np.array([np.cos(values["psi"]), np.sin(values["psi"])])
        return np.array([values[n] for n in self.names])

    def steps(self, at: np.ndarray) -> np.ndarray:
        """Finite-difference steps, towards the inside of the range."""
        if self.effect == "virtual_neutral":
            return np.array([1.0]) if at[0] < 0.5 else np.array([-1.0])
        reach = self.high - self.low
        return np.where(at + 0.3 * reach <= self.high, 0.3, -0.3) * reach


COORDINATES = {effect: Coordinates(effect) for effect in EFFECTS}
