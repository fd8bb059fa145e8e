"""A trained identification as one object: estimator, scaling and intervals, saved as one readable file."""

import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import closed_form, schema
from ..actuator.parameters import ActuatorParameters
from ..errors import InputError, one_line, shown
from ..faults import FAULT_NAMES
from ..io.atomic import replace_atomically
from ..plain import array, read_json
from ..reconstruction.features import Features
from .intervals import ConformalIntervals
from .network import Network, logarithmic
from .posterior import Knowledge, Posterior, model_error, nominal_nine, posterior
from .settings import NetworkSettings, TrainingSettings
from .training import TrainedNetwork, train

ESTIMATORS = ("network", "closed_form")
LEAST_NOISE = 1e-12  # relative variance of a feature; those without noise have a covariance with an inverse, too
FILE = "identifier.json"
_FORMAT = 1
_KEYS = (
    "format", "estimator", "actuator", "alpha_m", "lag", "intervals", "network", "feature_low", "feature_high",
    "healthy", "known", "noise", "intervals_of_units",
    "network_of_units",
)  # fmt: skip


@dataclass(frozen=True)
class Identifier:
    """A trained estimator with its intervals.

    Features are (run, 6) [R_a, R_b, R_c, k_a, k_b, k_c], (run, 8) with xi_x and xi_y behind them where the
    reconstruction measures xi by itself, or (run, 9) with L_a, L_b, L_c behind them. A ``unit`` is the (6,) or (run, 6)
    array of R and k of the healthy unit at 20 degC, of nine features (9,) or (run, 9) with L: features and covariance
    are scaled to the nominal actuator before use. What is not known of the unit is added to their covariance, by its
    healthy recordings or, of a unit that was not measured, as ``known``: intervals count it, and the closed form of
    nine features weighs by it.
    """

    actuator: ActuatorParameters
    alpha_m: float
    lag: float  # K, expected, of the magnets behind the winding
    intervals: ConformalIntervals
    network: Network | None = None  # None: the closed form
    feature_low: np.ndarray | None = None  # (feature,) range of the rows learnt from
    feature_high: np.ndarray | None = None
    healthy: np.ndarray | None = None  # R, k (and L) that it takes for healthy at 20 degC; None: the nominal ones
    known: Knowledge = field(default_factory=Knowledge)  # of any unit and its magnets, beforehand
    noise: np.ndarray | None = None  # (6, 6) relative covariance of R and k, of a reconstruction that tells none
    #: of units with healthy recordings, where these take out a bias that ``intervals`` hold, and the network that
    #: weighs nine features as one such recording leaves them known; None: the same
    intervals_of_units: ConformalIntervals | None = None
    network_of_units: Network | None = None

    @property
    def estimator(self) -> str:
        """``network`` or ``closed_form``."""
        return "closed_form" if self.network is None else "network"

    @property
    def parameters(self) -> int:
        """Number of trained weights; 0 for the closed form."""
        return 0 if self.network is None else self.network.parameters

    @property
    def prior(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Mean and covariance of R0, k0, L0 of any unit, for ``calibrate``; None where nothing is left open."""
        covariance, mean = self.known.covariance(), nominal_nine(self.actuator)
        biased = self.network is None and self.noise is not None  # about the unit, by what no network has learnt
        if biased or not np.any(covariance):
            return None
        if self.healthy is not None:
            mean[: len(self.healthy)] = self.healthy
        return mean, covariance * np.outer(mean, mean)

    def predict(
        self,
        features: np.ndarray,
        covariance: np.ndarray | None = None,
        unit: np.ndarray | None = None,
        unit_covariance: np.ndarray | None = None,
    ) -> np.ndarray:
        """Faults (run, 6) in SI units.

        Raises
        ------
        InputError : features of the wrong shape, or nine without covariance for the closed form
        """
        features, covariance = self._nominal(features, covariance, unit, unit_covariance)
        return _estimate(self._beside(unit), features, covariance)

    def interval(
        self,
        features: np.ndarray,
        level: float = 0.9,
        covariance: np.ndarray | None = None,
        unit: np.ndarray | None = None,
        unit_covariance: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Low and high end (run, 6) of the prediction interval at ``level``.

        ``covariance`` (run, 6, 6) of the features, or (run, 9, 9) of nine, scales the width of each run; without it
        that of the calibration rows is taken. ``unit_covariance``, (6, 6) or (run, 6, 6) of ``unit``, widens them, and
        so does, without ``unit``, what is not known of any unit.
        """
        untold = covariance is None
        features, covariance = self._nominal(features, covariance, unit, unit_covariance)
        own = self._beside(unit)
        value, variance = _estimate(own, features, covariance), _variance(own, features, covariance)
        if untold and variance is not None:  # that of the unit alone
            variance = variance + own.intervals.typical_variance
        half = own.intervals.half_width(level, variance, len(features))
        return value - half, value + half

    def estimate(
        self,
        features: np.ndarray,
        level: float = 0.9,
        covariance: np.ndarray | None = None,
        unit: np.ndarray | None = None,
        unit_covariance: np.ndarray | None = None,
    ) -> list[dict[str, dict[str, float]]]:
        """For each run {"Na": {"value": ..., "low": ..., "high": ...}, ...}."""
        value = self.predict(features, covariance, unit, unit_covariance)
        low, high = self.interval(features, level, covariance, unit, unit_covariance)
        return [
            {
                name: {"value": float(value[n, j]), "low": float(low[n, j]), "high": float(high[n, j])}
                for j, name in enumerate(FAULT_NAMES)
            }
            for n in range(len(value))
        ]

    def model_error(
        self,
        features: np.ndarray,
        covariance: np.ndarray | None,
        unit: np.ndarray | None = None,
        unit_covariance: np.ndarray | None = None,
    ) -> np.ndarray:
        """(run,) relative error of nine features beside their noise without which no fault of the unit explains them.

        Zero where noise explains them, and of six or eight features, which a fault always explains.
        """
        if np.shape(features)[1] != 9:
            return np.zeros(len(features))
        x, C = replace(self, network=None)._nominal(features, covariance, unit, unit_covariance)
        return np.zeros(len(x)) if C is None else model_error(x, C, self.actuator, self.alpha_m, self.known)

    def with_noise(self, features: Features) -> Features:
        """Features with the covariance of those learnt from, where their reconstruction tells none."""
        if self.noise is None or np.any(np.isfinite(features.covariance)):
            return features
        return replace(features, covariance=self.noise * features.six[:, :, None] * features.six[:, None, :])

    def outside(self, features: np.ndarray, unit: np.ndarray | None = None) -> np.ndarray:
        """How far each run (run,) lies outside the features learnt from, as a fraction of their range; 0 is inside."""
        if self.feature_low is None or self.feature_high is None:
            return np.zeros(len(features))
        x, _ = self._nominal(features, None, unit)
        beyond = np.maximum(self.feature_low - x, x - self.feature_high) / (
            self.feature_high - self.feature_low + 1e-30
        )
        return np.maximum(beyond.max(axis=1), 0.0)

    def _beside(self, unit: np.ndarray | None) -> "Identifier":
        """What identifies features of a unit with healthy recordings, or of one without."""
        if unit is None:
            return self
        return replace(
            self,
            intervals=self.intervals_of_units or self.intervals,
            network=self.network_of_units or self.network,
        )

    def _nominal(self, features, covariance, unit, unit_covariance=None) -> tuple[np.ndarray, np.ndarray | None]:
        features = np.atleast_2d(np.asarray(features, float))
        width = len(self.feature_low) if self.feature_low is not None else features.shape[1]
        if features.shape[1] != width or width not in (6, 8, 9):
            raise InputError(f"features: got {features.shape[1]} a run, this identifier accepts {width}")
        scaled = logarithmic(width)  # what a unit has a value of its own of
        nominal = nominal_nine(self.actuator)[:scaled]
        if covariance is not None:
            covariance = np.broadcast_to(np.asarray(covariance, float), (len(features), scaled, scaled))
        if unit is not None:
            unit = np.broadcast_to(np.asarray(unit, float), (len(features), scaled))
            scale = (nominal if self.healthy is None else self.healthy) / unit
            features = np.concatenate([features[:, :scaled] * scale, features[:, scaled:]], axis=1)
            if covariance is not None:
                covariance = covariance * scale[:, :, None] * scale[:, None, :]
            if unit_covariance is not None:
                share = features[:, :scaled] / unit  # an error of the unit's R or k is one of the scaled feature
                added = np.asarray(unit_covariance, float) * share[:, :, None] * share[:, None, :]
                covariance = added if covariance is None else covariance + added
        elif np.any(known := self.known.covariance()[:scaled, :scaled]):
            added = known * features[:, :scaled, None] * features[:, None, :scaled]
            if covariance is not None:
                covariance = covariance + added
            elif self.network is not None or width != 9:  # which weighs by the noise, too
                covariance = added
        return features, covariance

    def save(self, folder: str | Path) -> None:
        """Write ``identifier.json`` into a folder, whole or not at all.

        Raises
        ------
        InputError : the folder cannot be written
        """
        plain = {
            "format": _FORMAT,
            "estimator": self.estimator,
            "actuator": asdict(self.actuator),
            "alpha_m": self.alpha_m,
            "lag": self.lag,
            "intervals": self.intervals.to_plain(),
            "network": self.network.to_plain() if self.network else None,
            "feature_low": None if self.feature_low is None else self.feature_low.tolist(),
            "feature_high": None if self.feature_high is None else self.feature_high.tolist(),
            "healthy": None if self.healthy is None else self.healthy.tolist(),
            "known": asdict(self.known),
            "noise": None if self.noise is None else self.noise.tolist(),
            "intervals_of_units": None if self.intervals_of_units is None else self.intervals_of_units.to_plain(),
            "network_of_units": None if self.network_of_units is None else self.network_of_units.to_plain(),
        }
        replace_atomically(Path(folder) / FILE, lambda path: path.write_text(json.dumps(plain)))

    @classmethod
    def load(cls, folder: str | Path) -> "Identifier":
        """Read what :meth:`save` wrote.

        Raises
        ------
        InputError : no such file, or not one of these
        """
        path = Path(folder) / FILE
        if not os.path.lexists(path):
            raise InputError(f"{path}: no such file; train the experiment first")
        plain = read_json(path)
        try:
            return _from_plain(plain)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            missing = "lacks " if isinstance(error, KeyError) else ""
            raise InputError(f"{shown(path)}: not a saved identifier ({missing}{one_line(error)})") from error


def _from_plain(plain: Any) -> Identifier:
    """An identifier from what was read, every key checked."""
    schema.check(plain, dict[str, Any], "identifier")
    if plain.get("format") != _FORMAT:
        raise InputError(f"format {plain.get('format')!r}, accepted is {_FORMAT}")
    for key in plain.keys() - set(_KEYS):
        raise InputError(schema.unknown_key(key, "identifier", _KEYS))
    schema.check(plain["estimator"], str, "estimator", {"accepted": ESTIMATORS})
    if (plain["network"] is None) != (plain["estimator"] == "closed_form"):
        schema.refuse("network", plain["network"], f"what the estimator {plain['estimator']} has")
    schema.check(plain["actuator"], schema.Actuator, "actuator")
    schema.check(plain["alpha_m"], float, "alpha_m", {"low": -0.01, "high": 0.01, "unit": "1/K"})
    schema.check(plain["lag"], float, "lag", {"low": -500.0, "high": 500.0, "unit": "K"})
    network = None if plain["network"] is None else Network.from_plain(plain["network"])
    inputs = 6 if network is None else len(network.scaler.feature_mean)
    low, high = (None if plain[key] is None else array(plain[key], key) for key in ("feature_low", "feature_high"))
    for key, values in {"feature_low": low, "feature_high": high}.items():
        if values is not None and values.shape not in ((6,), (8,), (9,)):
            raise InputError(f"{key}: got {shown(plain[key])}, accepted is one number for each feature")
        if network is not None and (values is None or len(values) != inputs):
            raise InputError(f"{key}: got {shown(plain[key])}, accepted are {inputs} numbers, as the network reads")
    if (low is None) != (high is None) or (low is not None and high is not None and np.any(low > high)):
        raise InputError("feature_high: is below feature_low, or one of the two is missing")
    healthy = None if plain.get("healthy") is None else array(plain["healthy"], "healthy")
    if healthy is not None and not (healthy.shape in ((6,), (9,)) and np.all(healthy > 0.0)):
        raise InputError(f"healthy: got {shown(plain['healthy'])}, accepted are R and k, or R, k and L, above 0")
    noise = None if plain.get("noise") is None else array(plain["noise"], "noise", (6, 6))
    if noise is not None and not (np.allclose(noise, noise.T, atol=0.0) and np.linalg.eigvalsh(noise)[0] > 0.0):
        raise InputError("noise: accepted is a symmetric, positive definite covariance of R and k")
    of_units = plain.get("intervals_of_units")
    network_of_units = None if plain.get("network_of_units") is None else Network.from_plain(plain["network_of_units"])
    if network_of_units is not None and (network is None or len(network_of_units.scaler.feature_mean) != inputs):
        raise InputError("network_of_units: accepted is one that reads what the network does")
    known = plain.get("known", {})
    schema.check(known, dict[str, Any], "known")
    for key in known:
        if key not in Knowledge.__dataclass_fields__:
            raise InputError(schema.unknown_key(key, "known", list(Knowledge.__dataclass_fields__)))
        schema.check(known[key], float, f"known.{key}", {} if key == "lag" else {"low": 0.0})
    return Identifier(
        ActuatorParameters(**plain["actuator"]),
        plain["alpha_m"],
        plain["lag"],
        ConformalIntervals.from_plain(plain["intervals"]),
        network,
        low,
        high,
        healthy,
        Knowledge(**known),
        noise,
        None if of_units is None else ConformalIntervals.from_plain(of_units),
        network_of_units,
    )


def over_laws(
    features: np.ndarray, faults: np.ndarray, actuator: ActuatorParameters, alpha_m: float, lag: float
) -> np.ndarray:
    """(run, 6) R and k over those of the fault laws, of nine features (run, 9) with L.

    Of the laws with and without xi in k the one that fits better counts.
    """
    used = logarithmic(features.shape[1])
    ratios = []
    for law in ("stator_fixed", "rotor_angle"):
        R, k = closed_form.forward(faults, actuator, alpha_m, faults[:, 5] - lag, law)
        true = np.concatenate([R, k, closed_form.inductance(faults, actuator)], axis=1)
        ratios.append(features[:, :used] / true[:, :used])
    return min(ratios, key=lambda r: float(np.sum(np.var(r, axis=0))))


def learnt_healthy(
    features: np.ndarray, faults: np.ndarray, actuator: ActuatorParameters, alpha_m: float, lag: float
) -> np.ndarray:
    """R, k and, of nine, L of the healthy nominal unit at 20 degC as a reconstruction, biased or not, gives them.

    A network learns the bias of its features along with the faults, so a unit must be compared with the nominal one
    as reconstructed, not as it is. The bias is the mean ratio of the features to the fault laws' R and k, where it
    differs from 1 by more than chance.
    """
    ratio = over_laws(features, faults, actuator, alpha_m, lag)
    bias = np.mean(ratio, axis=0)
    chance = 4.0 * np.std(ratio, axis=0) / np.sqrt(len(ratio))
    return nominal_nine(actuator)[: ratio.shape[1]] * np.where(np.abs(bias - 1.0) < chance, 1.0, bias)


def _estimate(identifier: Identifier, features: np.ndarray, covariance: np.ndarray | None = None) -> np.ndarray:
    if identifier.network is not None:
        return identifier.network.predict(features)
    if features.shape[1] == 9:
        return _posterior(identifier, features, covariance).faults
    R, k, model = features[:, :3], features[:, 3:6], identifier
    if features.shape[1] == 8:
        return closed_form.inverse_rotor_angle(
            R, k, features[:, 6:], model.actuator, model.alpha_m, covariance, model.lag
        )
    return closed_form.inverse(R, k, model.actuator, model.alpha_m, model.lag)


def _posterior(identifier: Identifier, features: np.ndarray, covariance: np.ndarray | None) -> Posterior:
    if covariance is None:
        raise InputError("covariance: none given, the closed form of nine features weighs them by it")
    return posterior(features, covariance, identifier.actuator, identifier.alpha_m, identifier.known)


def _variance(identifier: Identifier, features: np.ndarray, covariance: np.ndarray | None) -> np.ndarray | None:
    """Variance (run, 6) that the noise of the features makes in the estimates; None where it is not known."""
    if covariance is None or not np.any(np.isfinite(covariance)):
        return None
    if features.shape[1] == 9 and identifier.network is None:
        found = _posterior(identifier, features, covariance)
        return np.diagonal(found.covariance, axis1=1, axis2=2)
    if features.shape[1] != 8:
        derivative = closed_form.jacobian(lambda x: _estimate(identifier, x), features)
    else:  # least squares takes real numbers only
        columns = []
        for j in range(6):
            step = np.zeros(features.shape)
            step[:, j] = 1e-5 * features[:, j]
            change = _estimate(identifier, features + step, covariance) - _estimate(
                identifier, features - step, covariance
            )
            columns.append(change / (2.0 * step[:, j : j + 1]))
        derivative = np.stack(columns, axis=-1)
    return np.einsum("npi,nij,npj->np", derivative, covariance, derivative)


@dataclass(frozen=True)
class Fit:
    """A fitted identifier and, for a network, how its training went."""

    identifier: Identifier
    trained: TrainedNetwork | None = None


def fit_identifier(
    estimator: str,
    features: np.ndarray,
    faults: np.ndarray,
    actuator: ActuatorParameters,
    *,
    alpha_m: float = 0.0,
    lag: float = 0.0,
    known: Knowledge | None = None,
    covariance: np.ndarray | None = None,
    units: np.ndarray | None = None,
    network: Mapping[str, Any] | NetworkSettings | None = None,
    training: Mapping[str, Any] | TrainingSettings | None = None,
    intervals: str = "cross",
    folds: int = 5,
    seed: int = 0,
) -> Fit:
    """Train an estimator and calibrate its intervals on rows that it, or the network of their fold, was not trained on.

    Rows whose record gave no features (NaN) are left out. Intervals are calibrated on rows scaled to the nominal unit:
    what a unit is off by is not the estimator's error, and whoever identifies tells how well it is known. A biased
    reconstruction has its bias in a unit's healthy recordings, too: the closed form, which does not learn it, has other
    intervals with them than without. A network of nine features that learns from units that differ has a second one for
    units with a healthy recording, for how nine features are best weighed depends on what of the unit is known.

    Parameters
    ----------
    estimator : ``network`` or ``closed_form``
    features : (run, 6), (run, 8) or (run, 9); faults : (run, 6)
    alpha_m, lag : the magnets' temperature coefficient (1/K) and how much colder than the winding they are expected
        (K); the
        closed form needs them, a network learns them
    known : what is known beforehand of a unit without healthy recordings; of it the closed form of nine features
        makes its posterior, whose intervals it has, and its lag counts there
    covariance : (run, 6, 6) of R and k, to normalise the intervals, or (run, 9, 9) of nine features; None where the
        reconstruction gives none
    units : (run, 9) R0 (ohm), k0 (V s/rad) and L0 (H) of each run's unit; None where all are nominal
    intervals : ``cross`` (``folds`` further networks, all rows calibrate) or ``split`` (the test part of the
        70/15/15 calibrates)

    Raises
    ------
    InputError : an unknown estimator or kind of intervals
    """
    if estimator not in ESTIMATORS:
        raise InputError(f"estimator: got '{estimator}', accepted are {', '.join(ESTIMATORS)}")
    if intervals not in ("cross", "split"):
        raise InputError(f"intervals: got '{intervals}', accepted are cross and split")
    features, faults = np.asarray(features, float), np.asarray(faults, float)
    identified = np.all(np.isfinite(features), axis=1)
    if not np.all(identified):
        features, faults = features[identified], faults[identified]
        covariance = None if covariance is None else covariance[identified]
        units = None if units is None else units[identified]
    if len(features) < 10:
        raise InputError(f"identification: {len(features)} runs have features, at least 10 are needed to learn from")
    if covariance is not None and not np.all(np.isfinite(covariance)):
        covariance = None
    placeholder = ConformalIntervals("", np.empty((0, 6)), np.zeros(6), np.zeros(6))
    identifier = Identifier(actuator, alpha_m, lag, placeholder, None, features.min(axis=0), features.max(axis=0))
    identifier = replace(identifier, known=known or Knowledge(lag=lag))
    nominal, spread = features.copy(), covariance
    scaled = logarithmic(features.shape[1])
    if units is not None:
        scale = nominal_nine(actuator)[:scaled] / units[:, :scaled]
        nominal[:, :scaled] *= scale
        spread = None if covariance is None else covariance * scale[:, :, None] * scale[:, None, :]
    # nine features leave more than a fault, by which a network learns to weigh them where units differ; six do not
    learnt = features if scaled == 9 else nominal
    if covariance is None and scaled == 6:
        ratio = over_laws(nominal, faults, actuator, alpha_m, lag)
        noise = np.cov(ratio / np.mean(ratio, axis=0), rowvar=False) + LEAST_NOISE * np.eye(6)
        identifier = replace(identifier, noise=noise)
    trained = None
    if estimator == "network":
        trained = train(learnt, faults, network, training, seed)
        healthy = learnt_healthy(nominal, faults, actuator, alpha_m, lag)
        identifier = replace(identifier, network=trained.network, healthy=healthy)

    def scored(
        model: TrainedNetwork, learnt: np.ndarray, shown: np.ndarray, spread: np.ndarray | None, seed: int
    ) -> ConformalIntervals:
        """Intervals of a network by rows as ``shown``, of networks that learnt without them."""

        def part(of: TrainedNetwork, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
            own, noise = replace(identifier, network=of.network), None if spread is None else spread[rows]
            return _estimate(own, shown[rows], noise) - faults[rows], _variance(own, shown[rows], noise)

        if intervals == "split":
            residuals, variance = part(model, model.test_rows)
            return ConformalIntervals.calibrate(residuals, variance, "split, test rows")
        order = np.random.default_rng([seed, 20]).permutation(len(shown))
        parts = []
        for fold, left_out in enumerate(np.array_split(order, folds)):
            rest = np.setdiff1d(order, left_out)
            parts.append(part(train(learnt[rest], faults[rest], network, training, seed + 1000 * (fold + 1)), left_out))
        residuals = np.concatenate([p[0] for p in parts])
        variance = None if spread is None else np.concatenate([v for _, v in parts if v is not None])
        found = ConformalIntervals.calibrate(residuals, variance, f"cross-conformal, {folds} folds")
        return found.of_a_worse(part(model, model.test_rows)[0], residuals) if len(model.test_rows) else found

    if trained is None and features.shape[1] == 9:
        return Fit(replace(identifier, intervals=ConformalIntervals.gaussian("posterior of nine features")))
    if trained is None:
        residuals, variance = _estimate(identifier, nominal, spread) - faults, _variance(identifier, nominal, spread)
        found = ConformalIntervals.calibrate(residuals, variance, "closed form, all rows")
        if covariance is None and scaled == 6:
            unbiased = nominal.copy()
            healthy = learnt_healthy(nominal, faults, actuator, alpha_m, lag)
            unbiased[:, :scaled] *= nominal_nine(actuator)[:scaled] / healthy
            left = _estimate(identifier, unbiased) - faults
            of_units = ConformalIntervals.calibrate(left, None, "closed form, all rows less their bias")
            identifier = replace(identifier, intervals_of_units=of_units)
        return Fit(replace(identifier, intervals=found))
    found = scored(trained, learnt, nominal, spread, seed)
    if scaled == 9 and units is not None and spread is not None:
        # as a healthy recording with the noise of the row's own leaves the unit known
        draws = np.random.default_rng([seed, 40]).normal(size=nominal.shape)
        size = np.sqrt(np.diagonal(spread, axis1=1, axis2=2))
        alike = spread / (size[:, :, None] * size[:, None, :]) + LEAST_NOISE * np.eye(9)
        beside = nominal + size * (np.linalg.cholesky(alike) @ draws[:, :, None])[:, :, 0]
        other = train(beside, faults, network, training, seed)
        of_units = scored(other, beside, beside, 2.0 * spread, seed)
        identifier = replace(identifier, intervals_of_units=of_units, network_of_units=other.network)
    return Fit(replace(identifier, intervals=found), trained)
