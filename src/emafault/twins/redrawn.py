"""Measured machines whose truth is known: an effect of random size put into what the machine itself leaves.

To what the base model predicts, as it was fitted, comes one effect of the library at drawn parameters and the machine's
own residual, with either sign: the scatter and the imperfection of a real recording around a known cause.
"""

from dataclasses import dataclass, replace

import numpy as np

from emafault.gap.diagnose import Diagnosis
from emafault.gap.twin import Hypothesis
from emafault.twins.measured import MeasuredTwin

TRIES = 50  # draws of an effect before a machine is given up
SMALLEST = 0.01  # of the prior's width, to which an amplitude is scaled down at most, log-uniform


@dataclass(frozen=True)
class Redrawn:
    """A machine with one known effect."""

    twin: MeasuredTwin
    effect: str
    truth: np.ndarray  # (parameter,) of the twin


def redraw(machine: Diagnosis, rng: np.random.Generator, least: float) -> Redrawn | None:
    """The machine with a random effect that lies at least ``least`` (squared distance) from the base model.

    Parameters
    ----------
    machine : diagnosis of the machine as it was recorded, by a ``MeasuredTwin``; its fit says what it leaves
    least : squared distance, nuisances marginalised, on the recordings that are explored

    Returns
    -------
    None where no drawn effect lies so far
    """
    twin, problem, null = machine.twin, machine.explore, machine.found.null
    assert isinstance(twin, MeasuredTwin) and machine.ladder is not None
    fitted = machine.ladder.after.values
    base = fitted.copy()
    for m, p in enumerate(problem.parameters):
        if p.effect is not None:
            base[m] = p.off
    for _ in range(TRIES):
        hypothesis = twin.hypotheses[int(rng.integers(len(twin.hypotheses)))]
        truth = base.copy()
        truth[problem.effect_parameters(hypothesis)] = draw_parameters(machine, hypothesis, rng)
        explored = problem.predict(np.array([base, truth]))
        if problem.squared_distance(null, problem.whiten(explored[1] - explored[0])) >= least:
            break
    else:
        return None
    sign = rng.choice([-1.0, 1.0])
    blocks = {}
    for name, block in twin.blocks.items():
        before, known = twin.predict(np.array([fitted, truth]), [name])
        blocks[name] = replace(block, observed=known + sign * (block.observed - before))
    return Redrawn(replace(twin, blocks=blocks), hypothesis.effect, truth)


def draw_parameters(machine: Diagnosis, hypothesis: Hypothesis, rng: np.random.Generator) -> np.ndarray:
    """(parameter,) of an effect from their priors, what is zero without the effect scaled down at random."""
    problem = machine.explore
    own = [problem.parameters[m] for m in problem.effect_parameters(hypothesis)]
    drawn = np.array([np.clip(rng.normal(p.mean, p.sd), p.low, p.high) for p in own])
    off = np.array([p.off for p in own])
    amplitude = np.array([p.mean == p.off == 0.0 for p in own])
    scale = np.where(amplitude, SMALLEST ** rng.uniform(), 1.0)
    return off + scale * (drawn - off)
