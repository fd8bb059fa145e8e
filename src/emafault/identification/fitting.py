"""Identifiers from simulated runs: what is learnt, by whom, and on which rows the intervals are calibrated.

A closed form learns nothing; a network learns from rows, is the work of a ``Recipe``, and has its intervals from a
``HeldOut`` on rows that it, or the network of their fold, was not trained on.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from .. import closed_form
from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from ..faults import FAULT_NAMES
from .identifier import Identifier
from .intervals import ConformalIntervals, worse_than_folds
from .posterior import Knowledge, nominal_nine
from .rows import Rows, Table, TrainingRows, at_most
from .settings import NetworkSettings, TrainingSettings
from .training import TrainedNetwork, train

ROWS_A_TERM = 10  # of the polynomial of a reconstruction's bias
LEAST_NOISE = 1e-12  # relative variance of a feature; those without noise have a covariance with an inverse, too
KINDS = ("cross", "split")
STARTS = 4  # of a network, at most, until it errs no more than those of its folds


@dataclass(frozen=True)
class Prior:
    """What is taken for known before anything is learnt."""

    actuator: ActuatorParameters
    alpha_m: float = 0.0  # 1/K, of the magnets; the closed form needs it, a network learns it
    #: of a unit without healthy recordings and of the magnets' lag; of it the closed form of nine features makes its
    #: posterior, whose intervals it has
    known: Knowledge = field(default_factory=Knowledge)


@dataclass(frozen=True)
class Recipe:
    """How a network is trained; the same seed gives the same weights."""

    network: Mapping[str, Any] | NetworkSettings | None = None
    training: Mapping[str, Any] | TrainingSettings | None = None
    seed: int = 0

    def train(self, lesson: "Lesson", rows: np.ndarray | None = None, start: int = 0) -> TrainedNetwork:
        """A network that learnt some rows, or all; each start has a seed of its own."""
        seed = self.seed + 1000 * start
        return train(lesson.learnt, lesson.shown.faults, self.network, self.training, seed, rows)


@dataclass(frozen=True)
class Lesson:
    """What a network learns from, and the same rows as it is shown them later, on which it is judged."""

    learnt: Table  # (run, feature)
    shown: Rows

    def judged(
        self, identifier: Identifier, trained: TrainedNetwork, rows: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Errors (row, 6) of a network on some rows, and the variance of them that the features' noise makes."""
        of, own = self.shown.rows(rows), replace(identifier, network=trained.network)
        error = own.at_nominal(of.features, of.covariance) - of.faults
        return error, own.variance_at_nominal(of.features, of.covariance)


@dataclass(frozen=True)
class HeldOut:
    """Which rows calibrate a network's intervals.

    ``cross``: all of them, by ``folds`` further networks, each judged on the rows that it has not learnt; ``split``:
    the test rows of the network itself. Of many rows ``rows.MOST_AT_ONCE``, drawn at random, are judged.
    """

    kind: str = "cross"
    folds: int = 5

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"intervals: got '{self.kind}', accepted are {' and '.join(KINDS)}")

    def calibrated(
        self, identifier: Identifier, lesson: Lesson, recipe: Recipe
    ) -> tuple[TrainedNetwork, ConformalIntervals]:
        """A network that learnt a lesson, and its intervals.

        Folds stand for the network where it ends in as good an optimum as theirs: one that errs more on the rows that
        it did not learn, by no chance, is trained again from another start.
        """
        trained = recipe.train(lesson)
        if self.kind == "split":
            own = lesson.judged(identifier, trained, at_most(trained.test_rows, recipe.seed))
            return trained, ConformalIntervals.calibrate(*own, "split, test rows")
        intervals, of_folds = self.by_folds(identifier, lesson, recipe)
        best, worse = trained, np.full(len(FAULT_NAMES), np.inf)
        for start in range(STARTS):
            tried = trained if not start else recipe.train(lesson, start=self.folds + start)
            unlearnt = at_most(np.concatenate([tried.validation_rows, tried.test_rows]), recipe.seed)
            ratio = worse_than_folds(lesson.judged(identifier, tried, unlearnt)[0], of_folds)
            if np.prod(ratio) < np.prod(worse):
                best, worse = tried, ratio
            if np.all(worse == 1.0):
                break
        return best, intervals.widened(worse)

    def by_folds(self, identifier: Identifier, lesson: Lesson, recipe: Recipe) -> tuple[ConformalIntervals, np.ndarray]:
        """Intervals by networks that each have left a fold out, and their errors (row, 6)."""
        every = np.arange(len(lesson.learnt))
        order = np.random.default_rng([recipe.seed, 20]).permutation(every)
        parts = []
        for fold, left_out in enumerate(np.array_split(order, self.folds), start=1):
            of_fold = recipe.train(lesson, np.setdiff1d(every, left_out), fold)
            parts.append(lesson.judged(identifier, of_fold, at_most(left_out, recipe.seed, self.folds)))
        residuals = np.concatenate([error for error, _ in parts])
        told = [variance for _, variance in parts if variance is not None]
        variance = np.concatenate(told) if told else None
        return ConformalIntervals.calibrate(residuals, variance, f"cross-conformal, {self.folds} folds"), residuals


@dataclass(frozen=True)
class Fit:
    """A fitted identifier and, for a network, how its training went."""

    identifier: Identifier
    trained: TrainedNetwork | None = None


def fit_identifier(rows: Rows, prior: Prior, recipe: Recipe | None = None, held_out: HeldOut | None = None) -> Fit:
    """The network of a recipe, or without one the closed form, with intervals.

    Rows without features are left out. Intervals are calibrated on rows scaled to the nominal unit: what a unit is off
    by is not the estimator's error, and whoever identifies tells how well it is known.

    Raises
    ------
    InputError : too few rows with features, or impossible settings
    """
    rows = rows.identified()
    if recipe is None:
        return Fit(fit_closed_form(rows, prior))
    return fit_network(rows, prior, recipe, held_out or HeldOut())


def fit_closed_form(rows: Rows, prior: Prior) -> Identifier:
    """The closed form; of nine features its intervals are the posterior's, of others they are calibrated on all rows.

    A biased reconstruction has its bias in a unit's healthy recordings, too: the closed form, which does not learn it,
    has other intervals with them than without.
    """
    nominal = rows.some().of_nominal(prior.actuator).some()
    identifier = _untold(rows.extremes(), nominal, prior)
    if rows.features.shape[1] == 9:
        return replace(identifier, intervals=ConformalIntervals.gaussian("posterior of nine features"))
    error = identifier.at_nominal(nominal.features, nominal.covariance) - nominal.faults
    variance = identifier.variance_at_nominal(nominal.features, nominal.covariance)
    found = ConformalIntervals.calibrate(error, variance, "closed form, all rows")
    if rows.covariance is not None:
        return replace(identifier, intervals=found)
    unbiased = nominal.features.copy()
    unbiased[:, : rows.scaled] /= HealthyPoint.of(nominal, prior).bias
    left = identifier.at_nominal(unbiased) - nominal.faults
    of_units = ConformalIntervals.calibrate(left, None, "closed form, all rows less their bias")
    return replace(identifier, intervals=found, intervals_of_units=of_units)


def fit_network(rows: Rows, prior: Prior, recipe: Recipe, held_out: HeldOut) -> Fit:
    """A network; of nine features that learns from units that differ, a second one for units with a healthy recording.

    For how nine features are best weighed depends on what of the unit is known. Nine features leave more than a fault,
    by which a network learns to weigh them where units differ; six do not, and are learnt as of the nominal unit.
    """
    nominal = rows.of_nominal(prior.actuator)
    lesson = Lesson(rows.features if rows.scaled == 9 else nominal.features, nominal)
    some = nominal.some()
    blank = _untold(rows.extremes(), some, prior)
    trained, intervals = held_out.calibrated(blank, lesson, recipe)
    identifier = replace(
        blank,
        network=trained.network,
        healthy=HealthyPoint.of(some, prior).of_nominal(prior.actuator),
        intervals=intervals,
    )
    if rows.scaled == 9 and rows.units is not None and nominal.covariance is not None:
        shown = beside_a_healthy_recording(nominal, recipe.seed)
        lesson = Lesson(shown.features, shown)
        other, of_units = held_out.calibrated(identifier, lesson, recipe)
        identifier = replace(identifier, intervals_of_units=of_units, network_of_units=other.network)
    return Fit(identifier, trained)


def beside_a_healthy_recording(nominal: Rows, seed: int) -> Rows:
    """Rows as a healthy recording with the noise of each row's own leaves the unit known."""
    rng = np.random.default_rng([seed, 40])

    def noisy(rows: TrainingRows) -> TrainingRows:
        spread = rows.covariance
        assert spread is not None
        draws = rng.normal(size=rows.features.shape)
        size = np.sqrt(np.diagonal(spread, axis1=1, axis2=2))
        alike = spread / (size[:, :, None] * size[:, None, :]) + LEAST_NOISE * np.eye(9)
        features = rows.features + size * (np.linalg.cholesky(alike) @ draws[:, :, None])[:, :, 0]
        return TrainingRows(features, rows.faults, 2.0 * spread)

    return nominal.each(noisy)


def _untold(learnt: tuple[np.ndarray, np.ndarray], nominal: TrainingRows, prior: Prior) -> Identifier:
    """The closed form with all but its intervals; where no covariance is told, with that of the rows.

    ``learnt`` : least and greatest (feature,) of the rows; ``nominal`` : rows in memory
    """
    none = ConformalIntervals("", np.empty((0, 6)), np.zeros(6), np.zeros(6))
    noise = None
    if nominal.covariance is None and nominal.scaled == 6:
        noise = HealthyPoint.of(nominal, prior).covariance + LEAST_NOISE * np.eye(6)
    return Identifier(
        prior.actuator, prior.alpha_m, prior.known.lag, none, None, *learnt, known=prior.known, noise=noise
    )


def over_laws(rows: TrainingRows, prior: Prior) -> np.ndarray:
    """(run, 6) R and k of rows of the nominal unit over those of the fault laws, of nine features (run, 9) with L.

    Of the laws with and without xi in k the one that fits better counts.
    """
    ratios = []
    for law in ("stator_fixed", "rotor_angle"):
        R, k = closed_form.forward(rows.faults, prior.actuator, prior.alpha_m, rows.faults[:, 5] - prior.known.lag, law)
        true = np.concatenate([R, k, closed_form.inductance(rows.faults, prior.actuator)], axis=1)
        ratios.append(rows.features[:, : rows.scaled] / true[:, : rows.scaled])
    return min(ratios, key=lambda r: float(np.sum(np.var(r, axis=0))))


@dataclass(frozen=True)
class HealthyPoint:
    """R, k and, of nine features, L of a healthy unit as a reconstruction, biased or not, gives them over the true.

    The ratio of the features to the fault laws is fitted as a polynomial of the fault, quadratic where rows allow it,
    and taken without turns and eccentricity at the temperatures of the rows: a bias that changes with the fault is not
    that of a healthy recording. What the fit leaves, and what the bias changes by with temperature, is what a healthy
    recording scatters by.
    """

    bias: np.ndarray  # (6,) or (9,), 1 where it differs from that by no more than chance
    covariance: np.ndarray  # relative, of one healthy recording

    @classmethod
    def of(cls, rows: TrainingRows, prior: Prior) -> "HealthyPoint":
        """From rows of the nominal unit."""
        ratio = over_laws(rows, prior)
        healthy = rows.faults * (np.arange(rows.faults.shape[1]) == FAULT_NAMES.index("dT"))
        mean, spread = rows.faults.mean(axis=0), rows.faults.std(axis=0)
        spread = np.where(spread > 0.0, spread, 1.0)
        terms, at = (_polynomial((x - mean) / spread, len(ratio)) for x in (rows.faults, healthy))
        weights = np.linalg.pinv(terms)
        left = ratio - terms @ (weights @ ratio)
        noise = left.T @ left / (len(ratio) - np.linalg.matrix_rank(terms))
        of_healthy = at @ (weights @ ratio)
        bias = of_healthy.mean(axis=0)
        chance = 4.0 * np.sqrt(np.diagonal(noise)) * np.linalg.norm(at.mean(axis=0) @ weights)
        bias = np.where(np.abs(bias - 1.0) < chance, 1.0, bias)
        return cls(bias, (noise + np.cov(of_healthy, rowvar=False)) / np.outer(bias, bias))

    def of_nominal(self, actuator: ActuatorParameters) -> np.ndarray:
        """(6,) or (9,) R0 (ohm), k0 (V s/rad) and L0 (H) of the nominal unit as they are reconstructed."""
        return nominal_nine(actuator)[: len(self.bias)] * self.bias


def _polynomial(x: np.ndarray, rows: int) -> np.ndarray:
    """(run, term) products of up to two columns, or as many as there are ten rows each for."""
    columns = range(x.shape[1])
    terms = [np.ones((len(x), 1))]
    for degree in (1, 2):
        terms.append(
            np.stack([np.prod(x[:, c], axis=1) for c in combinations_with_replacement(columns, degree)], axis=1)
        )
        if sum(t.shape[1] for t in terms) * ROWS_A_TERM > rows:
            terms.pop()
            break
    return np.concatenate(terms, axis=1)
