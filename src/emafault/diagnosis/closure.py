"""How far the gap shrinks on recordings that took no part: the ladder of root mean squares of the whitened residual."""

from collections.abc import Mapping, Sequence

import numpy as np

from .linear import Weights, White, assemble, compressed, key_of, white_rows

STEPS = 2  # of a refit of what belongs to a recording alone
PLACEBOS = 20


def own(parameters: Sequence[str], recording: str) -> list[str]:
    """Nuisances of one recording alone."""
    return [n for n in parameters if n.endswith(f"@{recording}") and not n.startswith("controller.")]


class Ladder:
    """Confirm recordings under frozen models; each one's soak temperature and seeded fault are refitted."""

    def __init__(
        self, machine, recordings: Sequence[str], parameters: Mapping, weights: Mapping[tuple[str, str], Weights]
    ):
        self.machine, self.recordings, self.parameters, self.weights = machine, list(recordings), parameters, weights

    def blocks(self, values: Mapping[str, float]) -> tuple[list[White], dict[str, float]]:
        """Whitened blocks at frozen values, what is each recording's own refitted, and the values so found."""
        values = dict(values)
        out: list[White] = []
        for recording in self.recordings:
            free = [n for n in own(list(self.parameters), recording) if n in values]
            whites: list[White] = []
            for step in range(STEPS + 1):
                whites = [
                    compressed(b, *white_rows(b, free, False), self.weights.get(key_of(b)))
                    for b in self.machine.blocks(values, recording, wanted=free)
                ]
                if step == STEPS:
                    break
                normal = assemble(whites, free, {})
                sd = np.array([self.parameters[n].sd for n in free])
                mean = np.array([self.parameters[n].mean - values[n] for n in free])
                A = normal.H * np.outer(sd, sd) + np.eye(len(free))
                right = mean / sd - normal.g * sd
                for n, d in zip(free, sd * np.linalg.solve(A, right), strict=True):
                    values[n] += float(d)
            out += whites
        return out, values

    def rung(self, whites: Sequence[White], extra: Mapping[str, float] | None = None) -> tuple[float, int]:
        """Root mean square of the whitened residual and its number of rows."""
        total = sum(float(w.gram[-1, -1]) for w in whites)
        count = sum(w.count for w in whites)
        return float(np.sqrt(total / max(count, 1))), count

    def placebo(self, whites: Sequence[White], size: int) -> float:
        """Median root mean square with random signatures of as many parameters, their amplitudes from the noise.

        A signature that is fitted elsewhere and knows nothing of these recordings adds its own uncertainty: the fitted
        amplitude of a random column is a draw of unit variance over the column's norm.
        """
        rng = np.random.default_rng(20)
        base = sum(float(w.gram[-1, -1]) for w in whites)
        count = self.rung(whites)[1]
        return float(
            np.median([np.sqrt((base + rng.chisquare(max(size, 1))) / max(count, 1)) for _ in range(PLACEBOS)])
        )


def closed(recalibrated: float, after: float, floor: float, rows: int) -> float | None:
    """Share of the closable gap that is closed; None where the closable gap is below twice its standard error."""
    closable = recalibrated**2 - floor**2
    error = np.sqrt((4.0 * max(recalibrated, 1.0) ** 2 - 2.0) / max(rows, 1))
    return float((recalibrated**2 - after**2) / closable) if closable >= 2.0 * error else None
