"""A trained identification as one object: estimator, scaling and intervals, saved as one readable file."""

import json
import os
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

ESTIMATORS = ("network", "closed_form")
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
        return (self if unit is None else self.calibrated).at_nominal(features, covariance)

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
        own = self if unit is None else self.calibrated
        value, variance = own.at_nominal(features, covariance), own.variance_at_nominal(features, covariance)
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

    def at_nominal(self, features: np.ndarray, covariance: np.ndarray | None = None) -> np.ndarray:
        """Faults (run, 6) of features that are scaled to the nominal unit, their covariance with them."""
        if self.network is not None:
            return self.network.predict(features)
        if features.shape[1] == 9:
            return self._posterior(features, covariance).faults
        R, k = features[:, :3], features[:, 3:6]
        if features.shape[1] == 8:
            return closed_form.inverse_rotor_angle(
                R, k, features[:, 6:], self.actuator, self.alpha_m, covariance, self.lag
            )
        return closed_form.inverse(R, k, self.actuator, self.alpha_m, self.lag)

    def variance_at_nominal(self, features: np.ndarray, covariance: np.ndarray | None) -> np.ndarray | None:
        """Variance (run, 6) that the noise of the features makes in ``at_nominal``; None where it is not known."""
        if covariance is None or not np.any(np.isfinite(covariance)):
            return None
        if features.shape[1] == 9 and self.network is None:
            return np.diagonal(self._posterior(features, covariance).covariance, axis1=1, axis2=2)
        if features.shape[1] != 8:
            derivative = closed_form.jacobian(self.at_nominal, features)
        else:  # least squares takes real numbers only
            columns = []
            for j in range(6):
                step = np.zeros(features.shape)
                step[:, j] = 1e-5 * features[:, j]
                change = self.at_nominal(features + step, covariance) - self.at_nominal(features - step, covariance)
                columns.append(change / (2.0 * step[:, j : j + 1]))
            derivative = np.stack(columns, axis=-1)
        return np.einsum("npi,nij,npj->np", derivative, covariance, derivative)

    def _posterior(self, features: np.ndarray, covariance: np.ndarray | None) -> Posterior:
        if covariance is None:
            raise InputError("covariance: none given, the closed form of nine features weighs them by it")
        return posterior(features, covariance, self.actuator, self.alpha_m, self.known)

    @property
    def calibrated(self) -> "Identifier":
        """What identifies features of a unit with healthy recordings."""
        return replace(
            self,
            intervals=self.intervals_of_units or self.intervals,
            network=self.network_of_units or self.network,
        )

    def nominal_unit(self, width: int) -> np.ndarray:
        """R, k and, of a ``width`` of nine, L of the healthy unit that features of other units are scaled to."""
        return nominal_nine(self.actuator)[: logarithmic(width)] if self.healthy is None else self.healthy

    def _nominal(self, features, covariance, unit, unit_covariance=None) -> tuple[np.ndarray, np.ndarray | None]:
        features = np.atleast_2d(np.asarray(features, float))
        width = len(self.feature_low) if self.feature_low is not None else features.shape[1]
        if features.shape[1] != width or width not in (6, 8, 9):
            raise InputError(f"features: got {features.shape[1]} a run, this identifier accepts {width}")
        scaled = logarithmic(width)  # what a unit has a value of its own of
        if covariance is not None:
            covariance = np.broadcast_to(np.asarray(covariance, float), (len(features), scaled, scaled))
        if unit is not None:
            unit = np.broadcast_to(np.asarray(unit, float), (len(features), scaled))
            scale = self.nominal_unit(width) / unit
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
