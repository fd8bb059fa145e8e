"""Training of a network on features and faults: random split, standardisation, optimiser, learning curves."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .levenberg_marquardt import LearningCurve, Weights, initialise, outputs, train_lm
from .network import Network, Scaler
from .settings import NetworkSettings, TrainingSettings

Rows = tuple[np.ndarray, np.ndarray]


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
        optimise = train_lm if how.optimiser == "levenberg_marquardt" else _train_adam
        extra: dict[str, Any] = {}
        if optimise is _train_adam:
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


def _train_adam(
    weights: Weights,
    activation: str,
    train: Rows,
    validation: Rows,
    *,
    epochs: int,
    max_fail: int,
    weight_decay: float,
    learning_rate: float,
    batch: int,
    seed: int,
) -> tuple[Weights, LearningCurve]:
    """Adam in shuffled batches with a cosine fall of the learning rate; the weights of the best validation epoch.

    An epoch is ten passes over the rows, so that ``epochs`` and ``max_fail`` cost about what they do with
    Levenberg-Marquardt.
    """
    import torch

    passes = 10
    module = torch.nn.Sequential(*torch_layers(weights, activation))
    optimiser = torch.optim.Adam(module.parameters(), lr=learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, epochs, learning_rate / 100.0)
    order = torch.Generator().manual_seed(seed)
    (x, t), (xv, tv) = [(torch.from_numpy(a), torch.from_numpy(b)) for a, b in (train, validation)]
    matrices = [p for name, p in module.named_parameters() if name.endswith("weight")]
    size = sum(p.numel() for p in module.parameters())

    def read() -> Weights:
        linear = [layer for layer in module if isinstance(layer, torch.nn.Linear)]
        return [torch.column_stack([l.weight, l.bias]).detach().numpy().copy() for l in linear]

    best, best_error, fails = read(), np.inf, 0
    curve = LearningCurve(stopped="epochs")
    for epoch in range(epochs + 1):
        with torch.no_grad():
            curve.train.append(float(torch.mean((module(x) - t) ** 2)))
            curve.validation.append(float(torch.mean((module(xv) - tv) ** 2)))
        if curve.validation[-1] < best_error:
            best, best_error, curve.best_epoch, fails = read(), curve.validation[-1], epoch, 0
        else:
            fails += 1
        if fails >= max_fail:
            curve.stopped = "validation"
            break
        for _ in range(passes if epoch < epochs else 0):
            for rows in torch.randperm(len(x), generator=order).split(batch):
                optimiser.zero_grad()
                loss = torch.mean((module(x[rows]) - t[rows]) ** 2)
                if weight_decay:
                    loss = loss + weight_decay / size * sum((p**2).sum() for p in matrices)
                loss.backward()
                optimiser.step()
        schedule.step()
    return best, curve
