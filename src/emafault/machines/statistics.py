"""Statistics of recordings: means over stretches with their noise, and errors that neighbouring rows share."""

from itertools import pairwise

import numpy as np

LEAST = 1e-6  # of the largest, below which an eigenvalue of a smooth error is nothing


def smooth_error(x: np.ndarray, sd: float | np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    """A smooth instrument error of size ``sd`` (row,) that decorrelates over ``length`` along ``x`` (row,).

    Squared exponential; a twentieth of its variance is each row's own.

    Returns
    -------
    (row,) variance of each row's own part, (row, error) what errors of unit size that rows share add to each
    """
    x = np.asarray(x, float)
    scale = np.broadcast_to(np.asarray(sd, float), x.shape)
    kernel = np.exp(-0.5 * ((x[:, None] - x[None, :]) / length) ** 2) * scale[:, None] * scale[None, :]
    values, vectors = np.linalg.eigh(0.95 * kernel)
    kept = values > LEAST * max(values[-1], 1e-300)
    return 0.05 * scale**2, vectors[:, kept] * np.sqrt(values[kept])


def mean_variance(samples: np.ndarray, batches: int = 5) -> np.ndarray:
    """Variance of the mean of autocorrelated samples (time, ...) from the scatter of batch means about a straight line.

    The trend is removed because the model predicts it; with fewer than two samples per batch they are taken as white.
    """
    samples = np.asarray(samples, float)
    count = samples.shape[0]
    if count < 2 * batches:
        return samples.var(axis=0, ddof=1) / count if count > 1 else np.zeros(samples.shape[1:])
    edges = np.linspace(0, count, batches + 1).astype(int)
    means = np.stack([samples[a:b].mean(axis=0) for a, b in pairwise(edges)])
    line = np.linspace(-1, 1, batches).reshape((-1,) + (1,) * (means.ndim - 1))
    slope = (line * means).sum(axis=0) / (line**2).sum()
    rest = means - means.mean(axis=0) - slope * line
    return (rest**2).sum(axis=0) / (batches - 2) / batches
