"""Adam for small dense networks, in shuffled batches, without a graph of operations.

Kingma and Ba, *Adam: a method for stochastic optimization*, ICLR 2015, with the constants that they propose. A batch of
a network of some hundred weights costs ten products of small matrices; a framework that records operations takes
several times as long to record them.
"""

from collections.abc import Iterator

import numpy as np

from .levenberg_marquardt import ACTIVATIONS, Blocks, LearningCurve, Weights, flattened, is_no_bias, mean_square, shaped

PASSES = 10  # over the rows an epoch, so that epochs and failed checks cost about what Levenberg-Marquardt's do
_DECAYS, _LEAST = (0.9, 0.999), 1e-8  # of the mean and the mean square of the gradient; added to the root of the latter
_LAST_RATE = 0.01  # of the first, at the last epoch


def gradient(weights: Weights, activation: str, x: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Derivative (weight,) of mean((y - t)^2) over rows and outputs by all weights, by backpropagation."""
    function, slope = ACTIVATIONS[activation]
    layers = [x]
    for W in weights[:-1]:
        layers.append(function(layers[-1] @ W[:, :-1].T + W[:, -1]))
    delta = (2.0 / t.size) * (layers[-1] @ weights[-1][:, :-1].T + weights[-1][:, -1] - t)
    parts: Weights = []
    for W, a in zip(weights[::-1], layers[::-1]):
        parts.insert(0, np.concatenate([delta.T @ a, delta.sum(axis=0)[:, None]], axis=1))
        if a is not x:
            delta = (delta @ W[:, :-1]) * slope(a)
    return flattened(parts)


def _batches(rows: Blocks, batch: int, rng: np.random.Generator) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Every row once, in batches of a block's rows in random order."""
    for x, t in rows:
        order = rng.permutation(len(x))
        for start in range(0, len(x), batch):
            some = order[start : start + batch]
            yield x[some], t[some]


def train_adam(
    weights: Weights,
    activation: str,
    train: Blocks,
    validation: Blocks,
    *,
    epochs: int,
    max_fail: int,
    weight_decay: float,
    learning_rate: float,
    batch: int,
    seed: int,
) -> tuple[Weights, LearningCurve]:
    """Minimise mean(e^2) + weight_decay mean-per-weight(|w|^2); the weights of the best validation epoch.

    The learning rate falls as half a cosine from ``learning_rate`` to a hundredth of it at the last epoch.

    Parameters
    ----------
    weights : start; not changed
    train, validation : blocks of rows; no batch reaches from one block into another
    epochs, max_fail : each of ``PASSES`` passes over the rows; checks without a new best before stopping
    batch : rows of a step
    """
    w, like = flattened(weights), weights
    decay = 2.0 * weight_decay * is_no_bias(weights) / w.size
    mean, square, steps = np.zeros_like(w), np.zeros_like(w), 0
    rng = np.random.default_rng([seed, 12])
    best, best_error, fails = w, np.inf, 0
    curve = LearningCurve(stopped="epochs")
    for epoch in range(epochs + 1):
        for errors, rows in ((curve.train, train), (curve.validation, validation)):
            errors.append(mean_square(shaped(w, like), activation, rows))
        if curve.validation[-1] < best_error:
            best, best_error, curve.best_epoch, fails = w, curve.validation[-1], epoch, 0
        else:
            fails += 1
        if fails >= max_fail:
            curve.stopped = "validation"
            break
        share = _LAST_RATE + 0.5 * (1.0 - _LAST_RATE) * (1.0 + np.cos(np.pi * epoch / epochs))
        for _ in range(PASSES if epoch < epochs else 0):
            for x, t in _batches(train, batch, rng):
                g = gradient(shaped(w, like), activation, x, t) + decay * w
                steps += 1
                mean = _DECAYS[0] * mean + (1.0 - _DECAYS[0]) * g
                square = _DECAYS[1] * square + (1.0 - _DECAYS[1]) * g * g
                first, second = mean / (1.0 - _DECAYS[0] ** steps), square / (1.0 - _DECAYS[1] ** steps)
                w = w - learning_rate * share * first / (np.sqrt(second) + _LEAST)
    return shaped(best, like), curve
