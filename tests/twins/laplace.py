"""A small independent fit of a twin, so that its tests rest on the protocol alone."""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_triangular

from emafault.twins.measured import MeasuredTwin


class Fit:
    """Best fit of a set of effects by damped Gauss-Newton from each start; parameters at a bound are held there."""

    def __init__(self, twin: MeasuredTwin, effects: Sequence[str] = (), part: Sequence[str] | None = None):
        self.twin, self.part = twin, part or twin.explore
        self.names = [p.name for p in twin.parameters]
        self.mean, self.sd, self.low, self.high, self.step = (
            np.array([getattr(p, key) for p in twin.parameters]) for key in ("mean", "sd", "low", "high", "step")
        )
        chosen = [h for h in twin.hypotheses if h.effect in effects]
        assert len(chosen) == len(effects)
        self.free = [m for m, p in enumerate(twin.parameters) if p.effect is None or p.effect in effects]
        self.base = np.array([p.off if p.effect else p.mean for p in twin.parameters])
        self.factor = np.linalg.cholesky(twin.covariance(self.base, self.part))
        best = None
        for number in range(max([len(h.starts) for h in chosen], default=1)):
            at = self.base.copy()
            for h in chosen:
                at[[self.names.index(n) for n in h.parameters]] = h.starts[min(number, len(h.starts) - 1)]
            found = self._descend(at)
            best = found if best is None or found[0] > best[0] else best
        self.evidence, self.values, self.misfit, self.error = best
        self.size = len(self.factor)

    def __getitem__(self, name: str) -> float:
        return float(self.values[self.names.index(name)])

    def residual(self, values: np.ndarray) -> np.ndarray:
        r = self.twin.observed(self.part) - self.twin.predict(values, self.part)[0]
        return solve_triangular(self.factor, r, lower=True)

    def _objective(self, values: np.ndarray) -> float:
        away = ((values - self.mean) / self.sd)[self.free]
        return float(self.residual(values) @ self.residual(values) + away @ away)

    def _descend(self, at: np.ndarray):
        free, damping = self.free, 1e-6
        value = self._objective(at)
        for _ in range(80):
            points = np.repeat(at[None], 2 * len(free), axis=0)
            for c, m in enumerate(free):
                points[2 * c, m] += self.step[m]
                points[2 * c + 1, m] -= self.step[m]
            moved = self.twin.predict(points, self.part)
            J = solve_triangular(
                self.factor, ((moved[::2] - moved[1::2]) / (2 * self.step[free])[:, None]).T, lower=True
            )
            H = J.T @ J + np.diag(1 / self.sd[free] ** 2)
            g = J.T @ self.residual(at) - ((at - self.mean) / self.sd**2)[free]
            held = ((at[free] <= self.low[free]) & (g < 0)) | ((at[free] >= self.high[free]) & (g > 0))
            open_ = np.flatnonzero(~held)
            gained = 0.0
            for _ in range(12):
                trial = at.copy()
                A = (H + damping * np.diag(np.diag(H)))[np.ix_(open_, open_)]
                at_free = np.array(free)[open_]
                moved_to = at[at_free] + np.linalg.solve(A, g[open_])
                trial[at_free] = np.clip(moved_to, self.low[at_free], self.high[at_free])
                tried = self._objective(trial)
                if tried <= value:
                    gained, at, value, damping = value - tried, trial, tried, damping / 10
                    break
                damping = max(10 * damping, 1e-8)
            if gained < 1e-6:
                break
        evidence = -0.5 * value - 0.5 * np.linalg.slogdet(H)[1] - np.log(self.sd[free]).sum()
        misfit = float(self.residual(at) @ self.residual(at))
        return evidence, at, misfit, dict(zip([self.names[m] for m in free], np.sqrt(np.diag(np.linalg.inv(H)))))


def rms(twin: MeasuredTwin, values: np.ndarray, part: Sequence[str]) -> float:
    """Root mean square of the whitened residual on a part at frozen parameters."""
    factor = np.linalg.cholesky(twin.covariance(values, part))
    r = solve_triangular(factor, twin.observed(part) - twin.predict(values, part)[0], lower=True)
    return float(np.sqrt(np.mean(r**2)))
