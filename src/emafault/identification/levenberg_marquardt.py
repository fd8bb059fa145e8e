"""Levenberg-Marquardt training of small dense networks, full batch, with early stopping as in MATLAB's trainlm.

The residuals of row n and output o are e = y - t. The derivative by the weight W_l[h, i] is delta_l[n, o, h]
a_{l-1}[n, i] with delta the backpropagated derivative of output o and a the layer's input (1 appended for the
bias), so that blocks of J'J are contractions over n of two small products and the Jacobian itself is never formed.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_factor, cho_solve

#: activation of the pre-activation, and its derivative by it as a function of the activation
ACTIVATIONS: dict[str, tuple[Callable, Callable]] = {
    "tanh": (np.tanh, lambda a: 1.0 - a * a),
    "sigmoid": (lambda z: 1.0 / (1.0 + np.exp(-z)), lambda a: a * (1.0 - a)),
    "relu": (lambda z: np.where(z.real > 0, z, 0.0), lambda a: (a > 0).astype(float)),
}
#: one matrix a layer, (output, input + 1), the bias in the last column
Weights = list[np.ndarray]
#: inputs (row, feature) and targets (row, output), a block of rows at a time, as often as they are asked for
Blocks = Iterable[tuple[np.ndarray, np.ndarray]]


@dataclass
class LearningCurve:
    """Mean squared error by epoch of training and validation rows, the epoch kept and why training stopped."""

    train: list[float] = field(default_factory=list)
    validation: list[float] = field(default_factory=list)
    best_epoch: int = 0
    stopped: str = ""


def initialise(sizes: tuple[int, ...], rng: np.random.Generator) -> Weights:
    """Small random weights (Glorot-scaled normal, zero biases) of a network with the given layer sizes."""
    return [np.hstack([rng.normal(0.0, np.sqrt(1.0 / i), (o, i)), np.zeros((o, 1))]) for i, o in pairwise(sizes)]


def flattened(weights: Weights) -> np.ndarray:
    """All weights (weight,), layer after layer and row-major in each."""
    return np.concatenate([W.ravel() for W in weights])


def shaped(w: np.ndarray, like: Weights) -> Weights:
    """Weights of the shapes of others, from ``flattened`` ones."""
    ends = np.cumsum([0, *(W.size for W in like)])
    return [w[start:end].reshape(W.shape) for W, (start, end) in zip(like, pairwise(ends))]


def is_no_bias(weights: Weights) -> np.ndarray:
    """(weight,) which of ``flattened`` weights are of an input, and decay."""
    return np.concatenate([(np.arange(W.size) % W.shape[1] != W.shape[1] - 1) for W in weights])


def outputs(weights: Weights, activation: str, x: np.ndarray) -> np.ndarray:
    """Outputs (row, output) of a dense network with a linear last layer; complex inputs pass through."""
    function = ACTIVATIONS[activation][0]
    for W in weights[:-1]:
        x = function(x @ W[:, :-1].T + W[:, -1])
    return x @ weights[-1][:, :-1].T + weights[-1][:, -1]


def _layers(weights: Weights, activation: str, x: np.ndarray):
    """Each layer's input with 1 appended, (row, input + 1), and delta, (row, output, unit); the outputs."""
    function, slope = ACTIVATIONS[activation]
    ones = np.ones((len(x), 1))
    inputs, slopes = [np.hstack([x, ones])], []
    for W in weights[:-1]:
        activations = function(inputs[-1] @ W.T)
        slopes.append(slope(activations))
        inputs.append(np.hstack([activations, ones]))
    y = inputs[-1] @ weights[-1].T
    deltas = [np.broadcast_to(np.eye(y.shape[1]), (len(x), y.shape[1], y.shape[1]))]
    for W, d in zip(weights[:0:-1], slopes[::-1]):
        deltas.insert(0, (deltas[0] @ W[:, :-1]) * d[:, None, :])
    return inputs, deltas, y


def jacobian(weights: Weights, activation: str, x: np.ndarray) -> np.ndarray:
    """Derivative of the outputs by all weights, (row, output, weight), layer after layer and row-major in each."""
    inputs, deltas, _ = _layers(weights, activation, x)
    blocks = [(d[..., None] * a[:, None, None, :]).reshape(*d.shape[:2], -1) for a, d in zip(inputs, deltas)]
    return np.concatenate(blocks, axis=-1)


def mean_square(weights: Weights, activation: str, rows: Blocks) -> float:
    """Mean of e^2 over rows and outputs."""
    total, count = 0.0, 0
    for x, t in rows:
        total += float(np.sum((outputs(weights, activation, x) - t) ** 2))
        count += t.size
    return total / count


def normal_equations(weights: Weights, activation: str, rows: Blocks) -> tuple[np.ndarray, np.ndarray, float, int]:
    """J'J (weight, weight), J'e (weight,), the sum of squares of e = y - t and how many e there are.

    J is never formed, and the derivatives of one block are in memory at a time.
    """
    size = sum(W.size for W in weights)
    JJ, Je, sse, count = np.zeros((size, size)), np.zeros(size), 0.0, 0
    for x, t in rows:
        more = _normal_equations(weights, activation, x, t)
        JJ += more[0]
        Je += more[1]
        sse, count = sse + more[2], count + t.size
    return JJ, Je, sse, count


def _normal_equations(weights: Weights, activation: str, x: np.ndarray, t: np.ndarray):
    inputs, deltas, y = _layers(weights, activation, x)
    e = y - t
    sizes = [W.size for W in weights]
    ends = np.cumsum([0, *sizes])
    JJ, Je = np.empty((ends[-1], ends[-1])), np.empty(ends[-1])
    last = len(weights) - 1
    for l, (a, d) in enumerate(zip(inputs, deltas)):
        rows = slice(ends[l], ends[l + 1])
        Je[rows] = np.einsum("noh,no->nh", d, e).T.dot(a).ravel()
        for m in range(l, last + 1):
            columns, b, f = slice(ends[m], ends[m + 1]), inputs[m], deltas[m]
            if l == last:
                block = np.kron(np.eye(y.shape[1]), a.T @ a)
            else:
                products = np.swapaxes(d, 1, 2) @ f  # (row, h, g), summed over the outputs
                h, g, i, j = d.shape[2], f.shape[2], a.shape[1], b.shape[1]
                pairs = (a[:, :, None] * b[:, None, :]).reshape(len(x), i * j)
                block = products.reshape(len(x), h * g).T @ pairs
                block = block.reshape(h, g, i, j).transpose(0, 2, 1, 3).reshape(h * i, g * j)
            JJ[rows, columns] = block
            JJ[columns, rows] = block.T
    return JJ, Je, float(np.sum(e**2))


def train_lm(
    weights: Weights,
    activation: str,
    train: Blocks,
    validation: Blocks | None = None,
    *,
    epochs: int = 1000,
    max_fail: int = 10,
    weight_decay: float = 0.0,
    mu: float = 1e-3,
    mu_inc: float = 10.0,
    mu_dec: float = 0.1,
    mu_max: float = 1e10,
    min_gradient: float = 1e-7,
) -> tuple[Weights, LearningCurve]:
    """Minimise mean(e^2) + weight_decay mean-per-row(|w|^2) and return the weights of the best validation epoch.

    Parameters
    ----------
    weights : start; not changed
    train, validation : blocks of rows; without validation rows the last weights are returned
    max_fail : validation checks without a new best before stopping
    mu, mu_inc, mu_dec, mu_max : damping of trainlm, relative to J'J over the number of residuals

    Returns
    -------
    the weights and the learning curve
    """
    w = flattened(weights)

    def error(w: np.ndarray, rows: Blocks) -> float:
        return mean_square(shaped(w, weights), activation, rows)

    decay = weight_decay * is_no_bias(weights) / w.size
    best, best_error, fails = w, np.inf, 0
    curve = LearningCurve(stopped="epochs")
    for epoch in range(epochs + 1):
        JJ, Je, sse, count = normal_equations(shaped(w, weights), activation, train)
        JJ /= count
        gradient = Je / count + decay * w
        JJ[np.diag_indices_from(JJ)] += decay
        objective = sse / count + decay @ w**2
        curve.train.append(sse / count)
        if validation is not None:
            curve.validation.append(error(w, validation))
        score = curve.validation[-1] if validation is not None else objective
        if score < best_error:
            best, best_error, curve.best_epoch, fails = w, score, epoch, 0
        else:
            fails += 1
        if fails >= max_fail and validation is not None:
            curve.stopped = "validation"
            break
        if np.linalg.norm(gradient) < min_gradient:
            curve.stopped = "gradient"
            break
        diagonal = JJ.diagonal().copy()
        while mu <= mu_max:
            JJ[np.diag_indices_from(JJ)] = diagonal + mu
            try:
                proposal = w - cho_solve(cho_factor(JJ, check_finite=False), gradient, check_finite=False)
                accepted = error(proposal, train) + decay @ proposal**2 < objective
            except np.linalg.LinAlgError:
                accepted = False
            if accepted:
                w, mu = proposal, mu * mu_dec
                break
            mu *= mu_inc
        else:
            curve.stopped = "damping"
            break
    return shaped(best, weights), curve
