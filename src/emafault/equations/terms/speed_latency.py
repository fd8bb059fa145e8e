"""The measured speed is first-order filtered."""

from ... import delays
from ...delays import filtered

SENTENCE = "the speed sensor lags"
SHAPES = ({"tau": 2e-4}, {"tau": 1e-3}, {"tau": 3e-3})
SHORTEST = 1e-6  # s
STEP = 1e-3  # of an interval, of which the derivative is taken


def response(p, rec):
    """Recorded speed after one interval's speed of one, in that interval and those that follow."""
    return delays.response(filtered, max(p("tau").value, 0.0) / rec.interval)


def speed(p, rec, w):
    """Recorded speed (rad/s) from the true one."""
    tau = p("tau")
    at, h = max(tau.value, 0.0), rec.interval
    if not tau.slopes:
        return w if at < SHORTEST else w.linear(lambda x: filtered(x, at / h), rec.size)
    slope = (filtered(w.value, at / h + STEP) - filtered(w.value, at / h)) / (STEP * h)
    return w.linear(lambda x: filtered(x, at / h), rec.size) + tau.through(0.0, slope)
