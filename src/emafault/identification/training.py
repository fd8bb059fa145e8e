"""Training of a network on features and faults: random split, standardisation, optimiser, learning curves."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .adam import train_adam
from .levenberg_marquardt import LearningCurve, Weights, initialise, outputs, train_lm
from .network import Network, Scaler
from .settings import NetworkSettings, TrainingSettings


@dataclass(frozen=True)
class TrainedNetwork:
    """A network, the learning curve of each pass and the rows it was trained, stopped and may be tested on."""

    network: Network
    curves: list[LearningCurve]
    train_rows: np.ndarray
    validation_rows: np.ndarray
    test_rows: np.ndarray


def split_rows(rows: int, training: TrainingSettings, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random training, validation and test rows.

    Raises
    ------
    InputError : too few rows for each part to have one
    """
    order = np.random.default_rng([seed, 10]).permutation(rows)
    first = round(training.train_fraction * rows)
    second = first + round(training.validation_fraction * rows)
    if first < 1 or second <= first:
        raise InputError(f"training: {rows} rows cannot be split, each part needs at least one")
    return np.sort(order[:first]), np.sort(order[first:second]), np.sort(order[second:])


def train(
    features: np.ndarray,
    faults: np.ndarray,
    network: Mapping[str, Any] | NetworkSettings | None = None,
    training: Mapping[str, Any] | TrainingSettings | None = None,
    seed: int = 0,
) -> TrainedNetwork:
    """Train one network; the same seed gives the same split, the same start and the same weights.

    Parameters
    ----------
    features : (run, feature) R (ohm) and k (V s/rad), then any further ones
    faults : (run, 6)
    network, training : settings, or mappings with the keys of :mod:`.settings`

    Raises
    ------
    InputError : an impossible setting, features that are not finite, too few rows
    """
    shape, how = NetworkSettings.of(network), TrainingSettings.of(training)
    features, faults = np.asarray(features, float), np.asarray(faults, float)
    if not np.all(np.isfinite(features)):
        row = int(np.argwhere(~np.isfinite(features))[0, 0])
        raise InputError(f"features: run {row} holds a value that is not finite; none are accepted for training")
    fit, validation, test = split_rows(len(features), how, seed)
    scaler = Scaler.fit(shape.coordinates, features[fit], faults[fit])
    x, t = scaler.features(features), scaler.faults(faults)
    weights = initialise(shape.sizes(x.shape[1], t.shape[1]), np.random.default_rng([seed, 11]))
    mix, curves = np.eye(t.shape[1]), []
    for turn in range(how.reweight + 1):
        if turn:
            residual = outputs(weights, shape.activation, x[fit]) - t[fit] @ mix.T
            # a ridge, since outputs that never vary leave no residual
            covariance = np.cov(residual.T) + 1e-12 * np.eye(len(mix))
            whiten = np.linalg.inv(np.linalg.cholesky(covariance))
            mix, weights = whiten @ mix, [*weights[:-1], whiten @ weights[-1]]
        rows = [(x[part], t[part] @ mix.T) for part in (fit, validation)]
        optimise = train_lm if how.optimiser == "levenberg_marquardt" else train_adam
        extra: dict[str, Any] = {}
        if optimise is train_adam:
            extra = {"learning_rate": how.learning_rate, "batch": how.batch, "seed": seed}
        weights, curve = optimise(
            weights,
            shape.activation,
            rows[0],
            rows[1],
            epochs=how.epochs,
            max_fail=how.max_fail,
            weight_decay=how.weight_decay,
            **extra,
        )
        curves.append(curve)
    weights = [*weights[:-1], np.linalg.solve(mix, weights[-1])]
    return TrainedNetwork(Network(shape, scaler, weights), curves, fit, validation, test)


def torch_layers(weights: Weights, activation: str) -> list:
    """The dense layers as torch modules in float64 with the given weights."""
    import torch

    function = {"tanh": torch.nn.Tanh, "sigmoid": torch.nn.Sigmoid, "relu": torch.nn.ReLU}[activation]
    layers: list[torch.nn.Module] = []
    for W in weights:
        layer = torch.nn.Linear(W.shape[1] - 1, W.shape[0], dtype=torch.float64)
        with torch.no_grad():
            layer.weight.copy_(torch.from_numpy(W[:, :-1].copy()))
            layer.bias.copy_(torch.from_numpy(W[:, -1].copy()))
        layers += [layer, function()]
    return layers[:-1]
