"""Errors of identified faults: in physical units, over range and beside the Cramer-Rao bound."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..faults import FAULT_NAMES
from .identifier import Identifier
from .intervals import coverage

#: outputs that are averaged together -> their columns in the fault vector
GROUPS = {"N": (0, 1, 2), "xi": (3, 4), "dT": (5,)}
_GAUSSIAN_MAE = np.sqrt(2.0 / np.pi)  # mean |e| over sigma
#: how many standard errors below the bound count as a leak rather than as chance
_LEAK_LIMIT = 3.0


@dataclass(frozen=True)
class FeatureSet:
    """Features of one reconstruction with their truth; ``bound`` is the Cramer-Rao standard deviation of each fault."""

    features: np.ndarray  # (run, 6), (run, 8) or (run, 9)
    faults: np.ndarray  # (run, 6)
    covariance: np.ndarray | None = None  # (run, 6, 6) or (run, 9, 9)
    bound: np.ndarray | None = None  # (run, 6) or (6,)

    def rows(self, index: Any) -> "FeatureSet":
        """The same with some of the rows."""
        bound = None if self.bound is None else np.broadcast_to(self.bound, self.faults.shape)[index]
        covariance = None if self.covariance is None else self.covariance[index]
        return FeatureSet(self.features[index], self.faults[index], covariance, bound)


def fault_range(
    shorted_turns: tuple[float, float], eccentricity: tuple[float, float], temperature: tuple[float, float]
) -> np.ndarray:
    """Width (6,) of the range each component is sampled from; each xi spans twice the largest radius."""
    return np.array(
        [*[shorted_turns[1] - shorted_turns[0]] * 3, *[2.0 * eccentricity[1]] * 2, temperature[1] - temperature[0]]
    )


def errors(
    estimate: np.ndarray, truth: np.ndarray, width: np.ndarray, bound: np.ndarray | None = None
) -> dict[str, dict[str, float]]:
    """Errors by component and for N, xi and dT together.

    Parameters
    ----------
    estimate, truth : (run, 6)
    width : (6,) range of each component, as :func:`fault_range`; a width of 0 leaves that error over range out
    bound : (run, 6) or (6,) Cramer-Rao standard deviations

    Returns
    -------
    output -> ``mae``, ``rmse``, ``bias``, ``worst`` in the component's unit, ``over_range`` (mae over width); with
    a bound also ``bound`` (the mean absolute error of an estimator that attains it), ``ratio`` (mae over it) and
    ``below_bound`` (1 where the ratio lies below 1 by more than chance: a leak of something no recording tells);
    ``mean`` holds the mean ``over_range``
    """
    error = np.asarray(estimate) - np.asarray(truth)
    groups = {name: (j,) for j, name in enumerate(FAULT_NAMES)} | GROUPS
    result: dict[str, dict[str, float]] = {}
    for name, columns in groups.items():
        e = error[:, columns]
        entry = {
            "mae": float(np.mean(np.abs(e))),
            "rmse": float(np.sqrt(np.mean(e**2))),
            "bias": float(np.mean(e)),
            "worst": float(np.max(np.abs(e))),
        }
        if np.all(width[list(columns)] > 0.0):
            entry["over_range"] = float(np.mean(np.abs(e) / width[list(columns)]))
        if bound is not None:
            attained = float(_GAUSSIAN_MAE * np.mean(np.broadcast_to(bound, error.shape)[:, columns]))
            # as if the components of a run erred together: the widest standard error of the ratio
            chance = np.sqrt((np.pi / 2.0 - 1.0) / len(error))
            ratio = entry["mae"] / attained
            entry |= {"bound": attained, "ratio": ratio, "below_bound": float(ratio < 1.0 - _LEAK_LIMIT * chance)}
        result[name] = entry
    shares = [result[name]["over_range"] for name in FAULT_NAMES if "over_range" in result[name]]
    result["mean"] = {"over_range": float(np.mean(shares))}
    return result


def leaks(result: Mapping[str, Any]) -> list[str]:
    """Outputs whose error lies below the bound by more than chance, from :func:`errors` or :func:`evaluate`."""
    table = result.get("errors", result)
    return [name for name, entry in table.items() if entry.get("below_bound")]


def evaluate(
    identifier: Identifier,
    fresh: FeatureSet,
    width: np.ndarray,
    level: float = 0.9,
    unit: np.ndarray | None = None,
    unit_covariance: np.ndarray | None = None,
) -> dict[str, Any]:
    """Evaluate on rows never trained on.

    Parameters
    ----------
    width : (6,) as :func:`fault_range`
    unit, unit_covariance : (6,) or (run, 6) R (ohm) and k (V s/rad) of each healthy unit at 20 degC, as its
        reference records give them, and their covariance; None takes every unit for the nominal actuator

    Returns
    -------
    ``rows`` evaluated, ``unidentified`` rows left out because their record gave no features, ``parameters``,
    ``errors`` (:func:`errors`), ``coverage`` of the intervals at ``level`` and their mean ``width`` by component
    """
    identified = np.all(np.isfinite(fresh.features), axis=1)
    if not np.any(identified):
        raise InputError("evaluation: no run has features to identify from; a motion of one electrical turn is needed")
    if not np.all(identified):
        fresh = fresh.rows(identified)
        unit = unit if unit is None or np.ndim(unit) == 1 else np.asarray(unit)[identified]
        if unit_covariance is not None and np.ndim(unit_covariance) == 3:
            unit_covariance = np.asarray(unit_covariance)[identified]
    value = identifier.predict(fresh.features, fresh.covariance, unit, unit_covariance)
    low, high = identifier.interval(fresh.features, level, fresh.covariance, unit, unit_covariance)
    return {
        "rows": len(value),
        "unidentified": int(np.sum(~identified)),
        "parameters": identifier.parameters,
        "errors": errors(value, fresh.faults, width, fresh.bound),
        "coverage": coverage(low, high, fresh.faults),
        "width": {name: float(np.mean(high[:, j] - low[:, j])) for j, name in enumerate(FAULT_NAMES)},
    }


def flatten(result: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    """Nested result as one level, ``errors.dT.mae``: the form in which metrics are logged."""
    flat: dict[str, float] = {}
    for key, value in result.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            flat |= flatten(value, f"{name}.")
        else:
            flat[name] = float(value)
    return flat


def over_seeds(results: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Mean, standard deviation, smallest and largest of each flattened metric over the results of several seeds."""
    tables = [flatten(result) for result in results]
    summary = {}
    for key in tables[0]:
        values = np.array([table[key] for table in tables])
        summary[key] = {
            "mean": float(values.mean()),
            "std": float(values.std()),
            "low": float(values.min()),
            "high": float(values.max()),
        }
    return summary
