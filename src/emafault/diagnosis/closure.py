"""How far the gap shrinks on recordings that took no part: the ladder of root mean squares of the whitened residual."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from .described import Described
from .evidence import Definite, Normal
from .fit import Bench
from .linear import White, assemble, columns_of_forms, compressed, correct, disturbance, white_rows
from .model import SETTINGS, Block
from .point import is_parameter
from .settling import Inserted

STEPS = 6  # of a refit of what belongs to a recording alone, at most
STILL = 0.05  # log evidence that one more of them may still promise
PLACEBOS = 20


class Ladder:
    """Confirm recordings under frozen models; what belongs to each recording alone is refitted.

    That is its initial winding temperature, its seeded fault and what else of its nuisances is its own, but for its
    controller's timing; of a form of the measuring chain only if the model has it.

    Parameters
    ----------
    bench : of all recordings
    recordings : those that confirm
    forms : described ones, with the shapes that the frozen models have them in
    """

    def __init__(self, bench: Bench, recordings: Sequence[str], forms: Sequence[Described]):
        self.machine, self.recordings = bench.machine.having(forms), list(recordings)
        self.parameters, self.carried = self.machine.parameters, bench.carried
        self.nuisances = set(bench.nuisances)

    def blocks(
        self,
        values: Mapping[str, float],
        remainders: bool = False,
        also: Collection[str] = (),
        inserted: Inserted | None = None,
        corrected: bool = False,
        settings: Collection[str] = (),
    ) -> list[White]:
        """Whitened blocks at frozen values, what is each recording's own refitted; with remainders if asked.

        ``also`` names parameters of the model, of which those of a recording are refitted too; ``inserted`` takes the
        remainders and own forms of a fitted set out of what is left. ``corrected`` gives each block the noise's part of
        its misfit. ``settings`` are parameters of all recordings that each is refitted in as well.
        """
        out: list[White] = []
        of_each = {n.rsplit("@", 1)[0] for n in also if "@" in n}
        shaped = columns_of_forms(inserted.own if inserted else None)
        for recording in self.recordings:
            own = f"@{recording}"
            free = [
                n for n in self.parameters
                if n.endswith(own) and not n.startswith("controller.timing")
                and (n in self.nuisances or n.removesuffix(own) in of_each)
            ]  # fmt: skip
            free += [n for n in settings if n in self.nuisances]
            mine, weights = {n: p.off for n, p in self.parameters.items()} | dict(values), self.carried[recording]
            for _ in range(STEPS):
                blocks = self.machine.blocks(mine, recording, wanted=[*free, *shaped])
                whites = [compressed(b, *self._rows(b, free, False, inserted), weights.get(b.equation)) for b in blocks]
                if corrected:
                    others = self.machine.blocks(mine, recording, disturbed=True, wanted=free)
                    for white, block, other in zip(whites, blocks, others, strict=True):
                        correct(white, disturbance(block, other, white.names, weights.get(block.equation)))
                if self._step(mine, free, assemble(whites, free, {})) < STILL:
                    break
            blocks = self.machine.blocks(mine, recording, wanted=[*free, *shaped])
            whites = [
                compressed(b, *self._rows(b, free, remainders, inserted), weights.get(b.equation)) for b in blocks
            ]
            if corrected:
                others = self.machine.blocks(mine, recording, disturbed=True, wanted=[])
                for white, block, other in zip(whites, blocks, others, strict=True):
                    white.own = float(disturbance(block, other, [], weights.get(block.equation))[0, 0])
            out += whites
        return out

    def _step(self, values: dict[str, float], free: Sequence[str], normal: Normal) -> float:
        """Moves values by a Gauss-Newton step of what is free; the log evidence that it promised."""
        sd = np.array([self.parameters[n].sd for n in free])
        mean = np.array([self.parameters[n].mean - values[n] for n in free])
        A = normal.H * np.outer(sd, sd) + np.eye(len(free))
        right = mean / sd - normal.g * sd
        moved = np.linalg.solve(A, right)
        values |= {n: values[n] + float(d) for n, d in zip(free, sd * moved, strict=True)}
        return 0.5 * float(moved @ right)

    @staticmethod
    def _rows(
        block: Block, free: Sequence[str], remainders: bool, inserted: Inserted | None
    ) -> tuple[list[str], np.ndarray]:
        if inserted is None:
            return white_rows(block, free, remainders)
        left = any(n.startswith(f"remainder.{block.equation}.") for n in inserted.beside)
        own = inserted.own if block.equation not in SETTINGS else None
        names, found = white_rows(block, free, left or remainders, own)
        found[:, -1] += found[:, :-1] @ np.array([inserted.beside.get(n, 0.0) for n in names])
        kept = [k for k, n in enumerate(names) if is_parameter(n) or (remainders and n.startswith("remainder."))]
        return [names[k] for k in kept], np.ascontiguousarray(found[:, [*kept, -1]])


def rms(whites: Sequence[White]) -> float:
    """Root mean square of the whitened residual."""
    return float(np.sqrt(sum(float(w.gram[-1, -1]) for w in whites) / max(rows(whites), 1)))


def rows(whites: Sequence[White]) -> int:
    """Number of rows used."""
    return sum(w.count for w in whites)


def coefficients(whites: Sequence[White]) -> tuple[float, int]:
    """Root mean square of what blocks with remainders still ask for in the coefficients of their equations' drivers,
    over its standard error, and the number of these coefficients; (nan, 0) without any."""
    total, count = 0.0, 0
    for w in whites:
        k = [
            i
            for i, n in enumerate(w.names)
            if n.startswith("remainder.") and n.endswith(".0") and n.split(".")[2] != "0"
        ]
        k = [i for i in k if w.gram[i, i] > 0.0]
        if k:
            M, b = w.gram[np.ix_(k, k)], w.gram[k, -1]
            total += float(b @ Definite(M).solve(b))
            count += len(k)
    return (float(np.sqrt(total / count)), count) if count else (float("nan"), 0)


def placebo(
    explored: Normal, confirm: Sequence[White], equations: Sequence[str], size: int
) -> tuple[float, list[White]]:
    """Median root mean square on the confirm recordings with random signatures fitted to the explored ones, and the
    blocks of the draw next to it.

    Parameters
    ----------
    explored : normal equations at the recalibrated nominal model, which stays as it is: of what its own parameters
        could make up for the explored recordings say nothing, and the others all the more
    confirm : blocks there, with their columns of remainders
    equations : in which the signatures act; they are random functions of the remainder's coordinates
    size : number of signatures, as many as the named set has parameters
    """
    every = list(dict.fromkeys(n for w in confirm for n in w.names if n.startswith("remainder.")))
    names = [n for n in every if n.split(".")[1] in equations and n in explored.index]
    base = float(sum(w.gram[-1, -1] for w in confirm))
    if not names or size < 1:
        return rms(confirm), list(confirm)
    held = assemble(confirm, names, {})
    k = np.array([explored.index[n] for n in names])
    M, b = explored.H[np.ix_(k, k)], -explored.g[k]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(M), 1e-12))
    rng = np.random.default_rng(20)
    found = []
    for _ in range(PLACEBOS):
        C = scale[:, None] * rng.standard_normal((len(names), size))
        a = C @ np.linalg.lstsq(C.T @ M @ C, C.T @ b, rcond=None)[0]
        found.append((max(base + 2.0 * held.g @ a + a @ held.H @ a, 0.0), a))
    middle = sorted(found, key=lambda x: x[0])[PLACEBOS // 2][1]
    median = float(np.sqrt(np.median([x for x, _ in found]) / max(rows(confirm), 1)))
    return median, [_added(w, dict(zip(names, middle, strict=True))) for w in confirm]


def _added(white: White, amounts: Mapping[str, float]) -> White:
    """A block with amounts of its own columns added to its residual."""
    turn = np.eye(len(white.gram))
    turn[:-1, -1] = [amounts.get(n, 0.0) for n in white.names]
    return replace(white, gram=turn.T @ white.gram @ turn)


def closed(recalibrated: float, after: float, floor: float, count: int) -> float | None:
    """Share of the closable gap that is closed; None where the closable gap is below twice its standard error."""
    closable = recalibrated**2 - floor**2
    error = np.sqrt((4.0 * max(recalibrated, 1.0) ** 2 - 2.0) / max(count, 1))
    return float((recalibrated**2 - after**2) / closable) if closable >= 2.0 * error else None
