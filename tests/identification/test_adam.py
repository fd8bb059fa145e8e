"""Adam against differences and against torch's own on the same rows."""

import numpy as np
import pytest

from emafault.identification.adam import PASSES, gradient, train_adam
from emafault.identification.levenberg_marquardt import ACTIVATIONS, flattened, initialise, outputs, shaped

ROWS = 40


@pytest.fixture(scope="module")
def rows():
    rng = np.random.default_rng(3)
    x = rng.normal(size=(ROWS, 4))
    return x, np.column_stack([x[:, 0] * x[:, 1], np.tanh(x[:, 2]) - x[:, 3]])


def network(layers, seed=5):
    return initialise((4, *([6] * layers), 2), np.random.default_rng(seed))


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_gradient_is_that_of_the_mean_squared_error(rows, activation, layers):
    weights = network(layers)
    w = flattened(weights)

    def error(w):
        return np.mean((outputs(shaped(w, weights), activation, rows[0]) - rows[1]) ** 2)

    h = 1e-6
    differences = [(error(w + h * e) - error(w - h * e)) / (2.0 * h) for e in np.eye(len(w))]
    np.testing.assert_allclose(gradient(weights, activation, *rows), differences, atol=1e-8)


@pytest.mark.parametrize("decay", [0.0, 0.02])
def test_steps_are_those_of_torch(rows, decay):
    import torch

    weights, epochs = network(2), 4
    # of batches of all rows the order does not matter
    how = {"epochs": epochs, "max_fail": 100, "weight_decay": decay, "learning_rate": 0.02, "batch": ROWS, "seed": 0}
    found, curve = train_adam(weights, "tanh", [rows], [rows], **how)

    size = sum(W.size for W in weights)
    tensors = [torch.tensor(W, requires_grad=True) for W in weights]
    optimiser = torch.optim.Adam(tensors, lr=0.02)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, epochs, 0.0002)
    x, t = (torch.from_numpy(a) for a in rows)
    for _ in range(epochs):
        for _ in range(PASSES):
            optimiser.zero_grad()
            a = x
            for W in tensors[:-1]:
                a = torch.tanh(a @ W[:, :-1].T + W[:, -1])
            error = torch.mean((a @ tensors[-1][:, :-1].T + tensors[-1][:, -1] - t) ** 2)
            (error + decay / size * sum((W[:, :-1] ** 2).sum() for W in tensors)).backward()
            optimiser.step()
        schedule.step()
    assert curve.best_epoch == epochs and len(curve.train) == epochs + 1
    for W, tensor in zip(found, tensors):
        np.testing.assert_allclose(W, tensor.detach().numpy(), atol=1e-9)


def test_the_best_epoch_is_kept_and_training_stops(rows):
    # rows to stop by that have nothing to do with those that are learnt
    strange = rows[0][::-1], -rows[1]
    how = {"epochs": 200, "max_fail": 5, "weight_decay": 0.0, "learning_rate": 0.05, "batch": 8, "seed": 1}
    found, curve = train_adam(network(1), "sigmoid", [rows], [strange], **how)
    assert curve.stopped == "validation" and len(curve.validation) == curve.best_epoch + 6
    kept = float(np.mean((outputs(found, "sigmoid", strange[0]) - strange[1]) ** 2))
    assert kept == min(curve.validation) and kept < curve.validation[-1]
