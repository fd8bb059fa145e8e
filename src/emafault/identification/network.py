"""The trained network with its scaling: from features in SI units to faults in SI units."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..errors import InputError
from ..plain import array
from .levenberg_marquardt import Weights, outputs
from .settings import NetworkSettings


@dataclass(frozen=True)
class Scaler:
    """Coordinates of the features (linear, or the log of R, k and L), standardised; standardised targets."""

    coordinates: str
    feature_mean: np.ndarray  # (feature,)
    feature_scale: np.ndarray
    fault_mean: np.ndarray  # (6,)
    fault_scale: np.ndarray

    @classmethod
    def fit(cls, coordinates: str, blocks: Iterable[tuple[np.ndarray, np.ndarray]]) -> "Scaler":
        """Mean and standard deviation of features and faults of the training rows; a constant column keeps scale 1.

        ``blocks`` : features (row, feature) and faults (row, 6), block by block; they are gone through twice
        """
        totals, squares = [np.zeros(1), np.zeros(1)], [np.zeros(1), np.zeros(1)]
        count = 0
        for block in _with_coordinates(coordinates, blocks):
            totals = [total + np.sum(x, axis=0) for total, x in zip(totals, block)]
            count += len(block[0])
        means = [total / count for total in totals]
        for block in _with_coordinates(coordinates, blocks):
            squares = [s + np.sum((x - mean) ** 2, axis=0) for s, x, mean in zip(squares, block, means)]
        deviations = [np.sqrt(square / count) for square in squares]
        scales = [np.where(deviation > 1e-12, deviation, 1.0) for deviation in deviations]
        return cls(coordinates, means[0], scales[0], means[1], scales[1])

    def features(self, x: np.ndarray) -> np.ndarray:
        """Standardised coordinates (run, feature) of features in SI units."""
        return (coordinates_of(self.coordinates, x) - self.feature_mean) / self.feature_scale

    def faults(self, f: np.ndarray) -> np.ndarray:
        """Standardised faults (run, 6)."""
        return (f - self.fault_mean) / self.fault_scale

    def faults_back(self, t: np.ndarray) -> np.ndarray:
        """Faults in SI units from standardised ones."""
        return t * self.fault_scale + self.fault_mean


def _with_coordinates(coordinates: str, blocks: Iterable[tuple[np.ndarray, np.ndarray]]) -> Iterator[list[np.ndarray]]:
    return ([coordinates_of(coordinates, features), faults] for features, faults in blocks)


def coordinates_of(coordinates: str, features: np.ndarray, runs: np.ndarray | None = None) -> np.ndarray:
    """The features as they are, or with R, k and L, which are all of them but a measured xi, in logarithms.

    ``runs`` : their numbers, for the message; None counts from 0

    Raises
    ------
    InputError : a logarithm of a value that is not positive
    """
    if coordinates == "linear":
        return features
    logs = logarithmic(features.shape[1])
    if np.any(np.real(features[:, :logs]) <= 0.0):
        row, column = np.argwhere(np.real(features[:, :logs]) <= 0.0)[0]
        name = [f"{quantity}_{phase}" for quantity in "RkL" for phase in "abc"][column]
        run, value = row if runs is None else runs[row], np.real(features[row, column])
        raise InputError(f"features: {name} of run {run} is {value:.4g}, accepted are values above 0")
    return np.concatenate([np.log(features[:, :logs]), features[:, logs:]], axis=1)


def logarithmic(width: int) -> int:
    """How many of ``width`` features, the first of them, are R, k or L: all nine, or six before a measured xi."""
    return 9 if width == 9 else 6


@dataclass(frozen=True)
class Network:
    """A dense network with tanh-like hidden layers and a linear output, and its scaler."""

    settings: NetworkSettings
    scaler: Scaler
    weights: Weights

    @property
    def parameters(self) -> int:
        """Number of weights and biases."""
        return sum(W.size for W in self.weights)

    def predict(self, features: np.ndarray) -> np.ndarray:
        """Faults (run, 6) from features (run, feature) in SI units."""
        return self.scaler.faults_back(outputs(self.weights, self.settings.activation, self.scaler.features(features)))

    def to_plain(self) -> dict[str, Any]:
        """Everything as plain lists; numbers survive JSON exactly."""
        scaler = {key: value.tolist() for key, value in vars(self.scaler).items() if key != "coordinates"}
        return {
            "settings": self.settings.as_dict(),
            "scaler": scaler,
            "weights": [W.tolist() for W in self.weights],
        }

    @classmethod
    def from_plain(cls, plain: dict[str, Any]) -> "Network":
        """The inverse of :meth:`to_plain`.

        Raises
        ------
        InputError : weights or scales that are not finite, or whose shapes are not those of the settings
        """
        settings = NetworkSettings.of(plain["settings"])
        features = len(plain["scaler"]["feature_mean"])
        sizes = {"feature_mean": features, "feature_scale": features, "fault_mean": 6, "fault_scale": 6}
        scales = {key: array(plain["scaler"][key], f"network.scaler.{key}", (n,)) for key, n in sizes.items()}
        for key in ("feature_scale", "fault_scale"):
            if not np.all(scales[key] > 0.0):
                raise InputError(f"network.scaler.{key}: got {scales[key].tolist()}, accepted are numbers above 0")
        shapes = [(o, i + 1) for i, o in pairwise(settings.sizes(features))]
        if not isinstance(plain["weights"], list) or len(plain["weights"]) != len(shapes):
            raise InputError(f"network.weights: accepted are {len(shapes)} layers, as network.settings has")
        weights = [array(W, "network.weights", shape) for W, shape in zip(plain["weights"], shapes)]
        return cls(settings, Scaler(settings.coordinates, **scales), weights)
