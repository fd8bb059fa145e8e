"""How visible a truth is: squared distances in noise units between what a bench shows and what other causes would show.

Distances are marginal over the nuisances: unit tolerances, initial winding temperatures and faults.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular
from scipy.optimize import lsq_linear

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..effects import EFFECTS, Effect
from .cases import Case
from .population import REFERENCE, Population
from .statistics import Unit, View, coarser, less, simulate_plan, simulate_plans

LATTICE = 1e6  # squared distance by which rounded values differ from unrounded ones: one look at them tells
PLAIN = 1e6  # above it a squared distance to the nominal model is not refined
SCATTER = 2.0  # half would be one run's variance; derivatives carry the scatter of several
LINEAR = 2.0  # prior standard deviations that no nuisance leaves where the first order is believed
STRIDE = 1.5  # largest step of a nuisance
FAR = 5.0  # no nuisance further than this, in prior standard deviations
AMBIENT = 0.5  # K, prior of the ambient temperature
FAULT_PRIOR = np.array([0.05, 0.05, 0.05, 0.1, 0.1])
FAULT_SCALE = np.array([0.1, 0.1, 0.1, 0.2, 0.2, 120.0])  # ranges, to add unlike components up


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
        population: Population = REFERENCE,
    ):
        self.case, self.actuator = case, actuator
        catalogue = population.catalogue
        self.coordinates = {effect: Coordinates(effect, catalogue) for effect in catalogue}
        self.unit = {k: dict(v) for k, v in case.tolerances.items()}
        self.tolerances = [
            (e.id, n, p.tolerance * abs(p.nominal))
            for e in catalogue.values()
            for n, p in e.parameters.items()
            if e.kind == "calibration" and p.tolerance > 0.0
        ]
        first = len(self.tolerances)
        owner: dict[str, int] = {}
        self.fault_columns: list[list[int]] = []  # per recording: N, xi (none in a healthy one), temperature
        for m, plan in enumerate(case.recordings):
            at: list[int] = []
            if plan.health != "healthy":
                start = owner.setdefault(plan.health if plan.health == "unknown" else f"{m}", first + 5 * len(owner))
                at = list(range(start, start + 5))
            self.fault_columns.append(at)
        warmth = first + 5 * len(owner)
        for m, at in enumerate(self.fault_columns):
            at.append(warmth + m)
        self.prior = np.array(
            [sd for _, _, sd in self.tolerances] + [*FAULT_PRIOR] * len(owner) + [AMBIENT] * len(case.recordings)
        )
        self.views: list[View] = []
        self.base: list[dict[str, np.ndarray]] = []
        blocks, repeats, deltas = [], [], []
        for m, fine in enumerate(case.recordings):
            plan, shown, merged = coarser(fine, truth[m])
            view = View(actuator, plan, case, noise, shown, merged)
            moved = [np.zeros(len(self.prior)), np.zeros(len(self.prior))]
            columns = [*range(first), *self.fault_columns[m]]
            for column in columns:
                moved.append(np.zeros(len(self.prior)))
                moved[-1][column] = self._step(column, warmth)
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
                block[:, column] = row / self._step(column, warmth)
            self._cancel(m, block)
            self.views.append(view)
            self.base.append(base)
            blocks.append(block)
            repeats.append(shifts[0])
            deltas.append(view.whiten(less(view.statistics(shown), base))[0])
        self.delta = np.concatenate(deltas)
        self.jacobian = np.concatenate(blocks)
        self.normal = cho_factor(np.eye(len(self.prior)) + self.jacobian.T @ self.jacobian)
        self.repeat = self.squared(np.concatenate(repeats))
        self.nominal: float | None = None
        self.lattice = LATTICE if "speed_quantisation" in case.effects else 0.0

    def _cancel(self, m: int, block: np.ndarray) -> None:
        """Derivative by k from those by R, L and the turns, in place, where a recording's turns are free.

        Turns shorted in all phases alike are a smaller R, k and L (twice): what cancels in truth must cancel here too,
        or the scatter of differences would tell a common short from a unit's tolerance.
        """
        turns = self.fault_columns[m][:-1][:3]
        if not turns:
            return
        at = {(effect, name): column for column, (effect, name, _) in enumerate(self.tolerances)}

        def by(effect: str, name: str) -> tuple[int, float]:
            """Column of a tolerance and its value in units of it."""
            column = at[effect, name]
            return column, self.unit[effect][name] / self.tolerances[column][2]

        R, of_R = by("unit_calibration", "R_scale")
        k, of_k = by("unit_calibration", "k_scale")
        L, of_L = by("inductance_tolerance", "L_scale")
        total = -of_R * block[:, R] - 2.0 * of_L * block[:, L]
        for column, N in zip(turns, self.case.recordings[m].fault[:3]):
            total -= (1.0 - N) / self.prior[column] * block[:, column]
        block[:, k] = total / of_k

    def _step(self, column: int, warmth: int) -> float:
        """Finite-difference step of a nuisance, in prior standard deviations."""
        if column < len(self.tolerances):
            return 1.5
        return 6.0 if column >= warmth else 0.4

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
        states = [self._state(m, x, effects) for m in range(len(self.views))]
        simulated = simulate_plans(self.actuator, [view.plan for view in self.views], states)
        shifts = [
            view.whiten(less(view.statistics(signals), base))[0]
            for view, base, signals in zip(self.views, self.base, simulated)
        ]
        return np.concatenate(shifts)

    def squared(self, shift: np.ndarray) -> float:
        """Squared length of a whitened shift, nuisances marginalised to first order."""
        inner = self.jacobian.T @ shift
        return float(shift @ shift - inner @ cho_solve(self.normal, inner))

    def columns(
        self,
        effect: str,
        at: np.ndarray,
        x: np.ndarray | None = None,
        there: np.ndarray | None = None,
        beside: Unit | None = None,
    ) -> np.ndarray:
        """Derivatives of all statistics by an effect's coordinates about ``at``, (statistic, coordinate)."""
        coordinates, others = self.coordinates[effect], beside or {}
        if there is None:
            there = self.shift(x, {**others, effect: coordinates.values(at)})
        columns = []
        for c, step in enumerate(coordinates.steps(at)):
            moved = at.copy()
            moved[c] += step
            columns.append((self.shift(x, {**others, effect: coordinates.values(moved)}) - there) / step)
        return np.stack(columns, 1)

    def distance_to(self, effect: str | None, iterations: int = 4, beside: Unit | None = None) -> float:
        """Squared distance from the truth to the nearest point of a model with one effect (None: the nominal model).

        ``beside`` are effects that the model has as well, at these values.

        Gauss-Newton on effect and nuisances with the nuisances' derivatives kept; what two runs of the same physics
        differ by is taken off.
        """
        lattice = 0.0 if effect == "speed_quantisation" else self.lattice
        coordinates = self.coordinates[effect] if effect and effect != "speed_quantisation" else None
        x = np.zeros(len(self.prior))
        at = coordinates.start.copy() if coordinates else np.zeros(0)

        def predicted(x: np.ndarray, at: np.ndarray) -> np.ndarray:
            own = {coordinates.effect: coordinates.values(at)} if coordinates else {}
            return self.shift(x, {**(beside or {}), **own})

        here = predicted(x, at) if coordinates or beside else np.zeros_like(self.delta)
        cost = float(np.sum((self.delta - here) ** 2))
        for _ in range(iterations):
            design = self.jacobian
            if coordinates:
                design = np.concatenate([design, self.columns(coordinates.effect, at, x, here, beside)], 1)
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
        distance = max(0.0, cost - self.repeat)
        if beside:
            return distance
        distance = min(distance, self._tolerance_cost(effect))
        if coordinates is None:
            self.nominal = distance
        elif coordinates.effect != "compliance":  # every other effect can be off, which is the nominal model
            if self.nominal is None:
                self.distance_to(None)
            distance = min(distance, self.nominal or 0.0)
        return distance + lattice

    def _tolerance_cost(self, effect: str | None) -> float:
        """Squared distance at which the unit's tolerances alone explain a truth of calibration effects."""
        others = [e for e in self.case.effects if e != effect]
        if not others or self.case.forms or any(EFFECTS[e].kind != "calibration" for e in others):
            return np.inf
        return sum(self._own_cost(e) for e in others)

    def _own_cost(self, effect: str) -> float:
        """Squared distance of a calibration effect of the truth from the unit's own tolerance draw."""
        drawn, value = self.unit[effect], self.case.effects[effect]
        return sum(((value[n] - drawn[n]) / sd) ** 2 for e, n, sd in self.tolerances if e == effect)

    def linear_distance(self, shift: np.ndarray, design: np.ndarray) -> float:
        """Squared distance from a shift to the span of some columns, nuisances marginalised, all to first order."""
        inner = self.jacobian.T @ design
        metric = design.T @ design - inner.T @ cho_solve(self.normal, inner)
        cross = design.T @ shift - inner.T @ cho_solve(self.normal, self.jacobian.T @ shift)
        return self.squared(shift) - float(cross @ np.linalg.pinv(metric, rcond=1e-10, hermitian=True) @ cross)

    def apart(self, one: Sequence[Mapping[str, np.ndarray]], other: Sequence[Mapping[str, np.ndarray]]) -> float:
        """Squared distance between two benches' noise-free signals, nuisances and the truth's effects free, to first
        order."""
        parts = []
        for fine, view, *signals in zip(self.case.recordings, self.views, one, other, strict=True):
            first, second = (view.statistics(coarser(fine, s)[1]) for s in signals)
            parts.append(view.whiten({n: second[n] - first[n] for n in first})[0])
        shift = np.concatenate(parts)
        effects = [e for e in self.case.effects if e != "speed_quantisation"]
        if not effects:
            return max(0.0, self.squared(shift) - self.repeat)
        truth = self.case.effects
        design = np.concatenate([self.columns(e, self.coordinates[e].point(truth[e])) for e in effects], 1)
        return max(0.0, self.linear_distance(shift, design) - self.repeat)

    def linear_rival(self, effect: str) -> float:
        """First-order squared distance from the truth to an effect: quick, and too large for strong truths."""
        if effect == "speed_quantisation":
            return self.squared(self.delta) + self.lattice
        return self.linear_distance(self.delta, self.columns(effect, self.coordinates[effect].start)) + self.lattice

    def distance_in_place(self, effect: str) -> float:
        """Squared distance from a truth of several effects to the nearest with this one in place of one of them, the
        others as they are."""
        truth = self.case.effects
        return min(self.distance_to(effect, beside={e: truth[e] for e in truth if e != out}) for out in truth)

    def detectability(self) -> Detectability:
        """Distances that go into the key."""
        effects = [e for e in self.case.effects if e != "speed_quantisation"]
        linear = self.squared(self.delta) + self.lattice
        nominal = min(linear, self._tolerance_cost(None) + self.lattice)
        if 5.0 < nominal < PLAIN:
            nominal = self.distance_to(None, 3)
            moved = cho_solve(self.normal, self.jacobian.T @ self.delta)
            if np.max(np.abs(moved)) < LINEAR:  # a fit by derivatives that scatter stops on its way
                nominal = min(nominal, linear)
        members = {e: LATTICE for e in self.case.effects if e not in effects}
        design = {e: self.columns(e, self.coordinates[e].point(self.case.effects[e])) for e in effects}
        for effect in effects:
            others = [e for e in effects if e != effect]
            if not others:
                members[effect] = max(0.0, nominal - self.lattice)
                continue
            rest = self.delta - self.shift(None, {e: self.case.effects[e] for e in others})
            distance = self.linear_distance(rest, np.concatenate([design[e] for e in others], 1))
            members[effect] = max(0.0, distance - self.repeat)
            if EFFECTS[effect].kind == "calibration":
                members[effect] = min(members[effect], self._own_cost(effect))
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


#: effects that have no meaning or no stable loop much outside their ranges
KEPT_IN_RANGE = ("back_emf_shape", "compliance", "dynamic_eccentricity", "speed_latency", "stribeck", "virtual_neutral")

#: effects that vanish at a point of their own: smallest values and those that a fit begins with, reference actuator
BEGUN = {"stribeck": ((0.0, 1.0), (0.005, 6.0)), "compliance": ((2e3, 200.0), (1e4, 300.0))}


class Coordinates:
    """Smooth coordinates in which an effect is fitted: its parameters, or what replaces them where singular."""

    def __init__(self, effect: str, catalogue: Mapping[str, Effect] = EFFECTS):
        self.effect = effect
        parameters = catalogue[effect].parameters
        self.names = [n for n in parameters if (effect, n) != ("self_heating", "Rth")]
        chosen = [parameters[n] for n in self.names]
        self.low = np.array([min(p.low, p.nominal) for p in chosen])
        self.high = np.array([max(p.high, p.nominal) for p in chosen])
        self.off = np.array([p.nominal for p in chosen])
        if catalogue[effect].kind == "structural" and effect not in KEPT_IN_RANGE:
            # beyond the realistic range as well: data that cannot tell two effects apart are not helped by a range
            self.low, self.high = self.off + 2.0 * (self.low - self.off), self.off + 2.0 * (self.high - self.off)
        self.start = self.off.copy()
        if effect == "dynamic_eccentricity":  # d cos psi, d sin psi
            self.low, self.high, self.off = np.full(2, -0.06), np.full(2, 0.06), np.zeros(2)
            self.start = self.off.copy()
        elif effect in BEGUN:
            low, start = BEGUN[effect]
            size = [p.high / EFFECTS[effect].parameters[n].high for n, p in zip(self.names, chosen)]
            self.low, self.start = np.multiply(size, low), np.multiply(size, start)

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
        return np.where(at + 0.2 * reach <= self.high, 0.2, -0.2) * reach
