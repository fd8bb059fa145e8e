"""The three currents add up to nothing, and a recorded sum shows gains, offsets and crosstalk of the sensors."""

import numpy as np

from .acquisition import OF_ONE_PHASE, bent, drifted, gain_of_its_own, picked_up, recorded_late
from .dual import Dual, value_of
from .point import State, effect_name
from .terms import with_hook


def residual(state: State) -> Dual:
    """Recorded sum (A) less what gains, offsets, drift, crosstalk, pickup, curves and lag make of currents that add up
    to nothing.

    The true currents are taken as the recorded ones less their mean: the noise of these is independent of that of the
    sum, so that no term can explain the noise. The recorded sum keeps coefficient one.
    """
    rec, p = state.rec, state.p
    true = np.array([np.asarray(value_of(i)) for i in state.current])
    out = Dual(rec.once(("sum",), lambda: rec.current.sum(axis=1)))
    for j, phase in enumerate("abc"):
        own = gain_of_its_own(p, "current", phase, rec)
        seen = Dual(true[j]) * own
        for m in reversed(with_hook("current")):
            seen = _recorded(m, p.of(effect_name(m)), j, seen)
        seen = _late(state, seen, phase)
        seen = seen + drifted(p, "current", phase, rec) + picked_up(p, phase, rec.voltage[:, j])
        for q, other in enumerate("abc"):
            if q != j:
                seen = seen + p(f"crosstalk_current.{phase}{other}") * true[q]
        seen = seen - bent(p, "current", phase, true[j], rec.actuator)
        out = out - seen
    return out


def _late(state: State, seen: Dual, phase: str) -> Dual:
    """What a channel records of what its sensor shows.

    The true currents are the recorded ones over their gains, less their mean, so that a change of one gain shows in the
    sum as the mean of what the three channels make of it: a gain common to all currents cannot be identified from
    their sum, whichever channel lags.
    """

    def of(x: Dual, q: str) -> Dual:
        return recorded_late(state.p, "current", x, state.rec.size, q)

    out = of(seen, phase)
    if not any(state.p(f"lag.current_{q}_{way}").value for q in "abc" for way in OF_ONE_PHASE):
        return out
    columns = {n: Dual(np.broadcast_to(slope, state.rec.size)) for n, slope in seen.slopes.items()}
    means = {n: sum(np.asarray(of(x, q).value) for q in "abc") / 3.0 for n, x in columns.items()}
    return Dual(out.value, out.slopes | means)


def _recorded(module, p, j: int, true: Dual) -> Dual:
    """Inverse of an effect's affine map from the recorded to the true current."""
    at_0, at_1 = module.current(p, j, Dual(0.0)), module.current(p, j, Dual(1.0))
    return (true - at_0) / (at_1 - at_0)


def noise_bands(state: State) -> list[np.ndarray]:
    """Diagonal of the noise's covariance (A2)."""
    return [np.full(state.rec.size, 3.0 * state.rec.noise.current**2)]
