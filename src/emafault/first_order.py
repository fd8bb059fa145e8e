"""A first-order filter along a signal."""

from .compiled import compiled


@compiled
def followed(x, gain, decay):
    """y[n] = gain x[n] + decay y[n - 1] from rest, x (sample,)."""
    y = x.copy()
    before = 0.0
    for n in range(x.shape[0]):
        before = gain * x[n] + decay * before
        y[n] = before
    return y
