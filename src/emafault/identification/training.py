"""Training of a network on features and faults: random split, standardisation, optimiser, learning curves."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .adam import train_adam
from .levenberg_marquardt import Blocks, LearningCurve, Weights, initialise, outputs, train_lm
from .network import Network, Scaler, coordinates_of
from .rows import Stored, Table, in_blocks
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


@dataclass(frozen=True)
class Examples:
    """Some of the rows as a network learns them, block by block: standardised features and faults.

    ``mix`` (6, 6) : what the faults are multiplied by; None for nothing
    """

    features: Table
    faults: Table
    rows: np.ndarray
    scaler: Scaler | None = None  # None: as they are, in SI units
    mix: np.ndarray | None = None

    def __iter__(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        for block in in_blocks(len(self.rows)):
            x, t = self.features[self.rows[block]], self.faults[self.rows[block]]
            if self.scaler is not None:
                x, t = self.scaler.features(x), self.scaler.faults(t)
            yield x, t if self.mix is None else t @ self.mix.T

    def at_hand(self) -> Blocks:
        """The same, made once where the rows are in memory."""
        return list(self) if isinstance(self.features, np.ndarray) else self


def train(
    features: Table,
    faults: Table,
    network: Mapping[str, Any] | NetworkSettings | None = None,
    training: Mapping[str, Any] | TrainingSettings | None = None,
    seed: int = 0,
    rows: np.ndarray | None = None,
) -> TrainedNetwork:
    """Train one network; the same seed gives the same split, the same start and the same weights.

    Parameters
    ----------
    features : (run, feature) R (ohm) and k (V s/rad), then any further ones
    faults : (run, 6)
    network, training : settings, or mappings with the keys of :mod:`.settings`
    rows : numbers of those learnt from; None for all

    Raises
    ------
    InputError : an impossible setting, features that are not finite, too few rows
    """
    shape, how = NetworkSettings.of(network), TrainingSettings.of(training)
    features, faults = (a if isinstance(a, Stored) else np.asarray(a, float) for a in (features, faults))
    rows = np.arange(len(features)) if rows is None else rows
    for block in in_blocks(len(rows)):
        _refuse_impossible(features[rows[block]], rows[block], shape.coordinates)
    fit, validation, test = (rows[part] for part in split_rows(len(rows), how, seed))
    scaler = Scaler.fit(shape.coordinates, Examples(features, faults, fit).at_hand())
    sizes = shape.sizes(features.shape[1], faults.shape[1])
    weights = initialise(sizes, np.random.default_rng([seed, 11]))
    mix, curves = np.eye(faults.shape[1]), []
    for turn in range(how.reweight + 1):
        if turn:
            whiten = _whitening(weights, shape.activation, Examples(features, faults, fit, scaler, mix))
            mix, weights = whiten @ mix, [*weights[:-1], whiten @ weights[-1]]
        learnt, stopped_by = (Examples(features, faults, part, scaler, mix).at_hand() for part in (fit, validation))
        limits: dict[str, Any] = {"epochs": how.epochs, "max_fail": how.max_fail, "weight_decay": how.weight_decay}
        if how.optimiser == "levenberg_marquardt":
            weights, curve = train_lm(weights, shape.activation, learnt, stopped_by, **limits)
        else:
            steps: dict[str, Any] = {"learning_rate": how.learning_rate, "batch": how.batch, "seed": seed}
            weights, curve = train_adam(weights, shape.activation, learnt, stopped_by, **limits, **steps)
        curves.append(curve)
    weights = [*weights[:-1], np.linalg.solve(mix, weights[-1])]
    return TrainedNetwork(Network(shape, scaler, weights), curves, fit, validation, test)


def _refuse_impossible(features: np.ndarray, rows: np.ndarray, coordinates: str) -> None:
    wrong = ~np.all(np.isfinite(features), axis=1)
    if np.any(wrong):
        row = int(rows[np.argmax(wrong)])
        raise InputError(f"features: run {row} holds a value that is not finite; none are accepted for training")
    coordinates_of(coordinates, features, rows)


def _whitening(weights: Weights, activation: str, examples: Examples) -> np.ndarray:
    """(6, 6) what makes the residuals of all outputs independent and of unit variance."""
    total, products, count = np.zeros(1), np.zeros(1), 0
    for x, t in examples:
        residual = outputs(weights, activation, x) - t
        total, products = total + np.sum(residual, axis=0), products + residual.T @ residual
        count += len(t)
    mean = total / count
    covariance = (products - count * np.outer(mean, mean)) / max(count - 1, 1)
    # a ridge, since outputs that never vary leave no residual
    return np.linalg.inv(np.linalg.cholesky(covariance + 1e-12 * np.eye(len(mean))))


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
