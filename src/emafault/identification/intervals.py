"""Prediction intervals by conformal prediction, normalised by the propagated noise of the features.

The score of a calibration row and output is |error| / scale. The scale is what the noise of the features makes of
the estimate, J covariance J', plus a constant variance for what the estimator itself misses: a network's
approximation, or magnets whose temperature no feature tells. Rows must not have been trained on: the residuals come
from cross-conformal folds, each predicted by a network trained without it (Vovk 2015,
doi:10.1007/s10472-013-9368-4), or from a held-out split. A half width is the ceil((n + 1) level)-th smallest score
times the scale, about the prediction of the network trained on all parts. For ``split`` coverage is at least the
level on average over exchangeable rows; for ``cross`` that is approximate, slightly wide since fold networks see
fewer rows, and too narrow where the network has ended in a worse optimum than theirs. The rows that it did not learn
tell: it is trained again from another start, and what is still worse after ``fitting.STARTS`` of them widens the
intervals.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import InputError, shown
from ..faults import FAULT_NAMES
from ..plain import array

WORSE = 3.0  # standard errors, from which a network errs more than those of its folds by no chance
GAUSSIAN_ROWS = 2_000  # quantiles that stand for a Gaussian


@dataclass(frozen=True)
class ConformalIntervals:
    """Calibrated scores; ``method`` says where the calibration rows came from."""

    method: str
    scores: np.ndarray  # (row, output), each column sorted
    missed_variance: np.ndarray  # (output,), SI squared, beyond the propagated noise
    typical_variance: np.ndarray  # (output,), used where a recording comes without covariance

    @classmethod
    def calibrate(cls, residuals: np.ndarray, variance: np.ndarray | None, method: str) -> "ConformalIntervals":
        """Scores of residuals (row, output) in SI units, given the propagated variance (row, output) or None."""
        if len(residuals) < 10:
            raise InputError(f"intervals: {len(residuals)} calibration rows, at least 10 are needed")
        square = np.mean(residuals**2, axis=0)
        if variance is None or not np.all(np.isfinite(variance)):
            variance = np.zeros_like(residuals)
        missed = np.maximum(square - variance.mean(axis=0), 0.0) + 1e-24
        scores = np.sort(np.abs(residuals) / np.sqrt(variance + missed), axis=0)
        return cls(method, scores, missed, np.median(variance, axis=0))

    def widened(self, ratio: np.ndarray) -> "ConformalIntervals":
        """Intervals that are ``ratio`` (output,) times as wide."""
        return replace(self, scores=self.scores * ratio)

    @classmethod
    def gaussian(cls, method: str) -> "ConformalIntervals":
        """Scores of Gaussian errors of exactly the variance that they are told, none being calibrated on rows."""
        from scipy.special import ndtri  # its import takes longer than the training of most networks

        quantiles = np.sort(np.abs(ndtri((np.arange(GAUSSIAN_ROWS) + 0.5) / GAUSSIAN_ROWS)))
        outputs = len(FAULT_NAMES)
        scores = np.repeat(quantiles[:, None], outputs, axis=1)
        return cls(method, scores, np.full(outputs, 1e-24), np.full(outputs, np.nan))

    def half_width(self, level: float, variance: np.ndarray | None, rows: int) -> np.ndarray:
        """Half widths (run, output) in SI units at a level, given the propagated variance of the runs or None.

        Raises
        ------
        InputError : a level that the number of calibration rows cannot support
        """
        n = len(self.scores)
        rank = int(np.ceil((n + 1) * level))
        if not 0.0 < level < 1.0 or rank > n:
            raise InputError(
                f"level: got {level}, accepted is above 0, up to {n / (n + 1):.4f} with {n} calibration rows"
            )
        if variance is None:
            variance = np.broadcast_to(self.typical_variance, (rows, self.scores.shape[1]))
        variance = np.where(np.isfinite(variance), variance, self.typical_variance)
        return self.scores[rank - 1] * np.sqrt(variance + self.missed_variance)

    def to_plain(self) -> dict[str, Any]:
        """Everything as plain lists; null for a typical variance that there is none of."""
        plain = {key: value if isinstance(value, str) else value.tolist() for key, value in vars(self).items()}
        return plain if np.all(np.isfinite(self.typical_variance)) else plain | {"typical_variance": None}

    @classmethod
    def from_plain(cls, plain: dict[str, Any]) -> "ConformalIntervals":
        """The inverse of :meth:`to_plain`.

        Raises
        ------
        InputError : scores that are not sorted, variances below 0, or other shapes
        """
        if not isinstance(plain, dict) or not isinstance(plain["method"], str):
            raise InputError(f"intervals: got {shown(plain)}, accepted are a method and its scores")
        scores = array(plain["scores"], "intervals.scores", (None, 6))
        if not len(scores) or np.any(scores < 0.0) or np.any(np.diff(scores, axis=0) < 0.0):
            raise InputError("intervals.scores: accepted are rows of scores from 0 up, sorted")
        variances = {}
        for key in ("missed_variance", "typical_variance"):
            if key == "typical_variance" and plain[key] is None:  # each run tells its own
                variances[key] = np.full(6, np.nan)
                continue
            variances[key] = array(plain[key], f"intervals.{key}", (6,))
            if np.any(variances[key] < 0.0):
                raise InputError(f"intervals.{key}: got {variances[key].tolist()}, accepted are numbers from 0")
        return cls(plain["method"], scores, **variances)


def worse_than_folds(own: np.ndarray, of_folds: np.ndarray) -> np.ndarray:
    """By how much a network's ``own`` errors on rows that it did not learn exceed those ``of_folds``, by output.

    Both (row, output). 1 where an output is worse by no more than chance, unless all those together are by more.
    """
    ratio = np.sqrt(np.mean(own**2, axis=0) / np.maximum(np.mean(of_folds**2, axis=0), 1e-300))
    spread = np.sqrt(0.5 / len(own) + 0.5 / len(of_folds))  # of a ratio of root mean squares
    worse = ratio > 1.0 + WORSE * spread
    others = np.maximum(ratio[~worse], 1e-300)
    if len(others) and np.exp(np.mean(np.log(others))) > 1.0 + WORSE * spread / np.sqrt(len(others)):
        worse[:] = True
    return np.where(worse, np.maximum(ratio, 1.0), 1.0)


def coverage(low: np.ndarray, high: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Share of rows whose truth lies in the interval, by fault component and over all of them (``mean``)."""
    inside = (low <= truth) & (truth <= high)
    return {name: float(inside[:, j].mean()) for j, name in enumerate(FAULT_NAMES)} | {"mean": float(inside.mean())}
