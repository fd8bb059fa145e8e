"""Recordings of a measured machine that could be made next: its own ones with the condition changed.

A twin lists them in ``experiments()``. Each says what one would set and what that makes of the inputs of a recording;
the noise and the instruments stay those of the recording.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .measured import MeasuredTwin

Inputs = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Experiment:
    """One recording that could be made: what one would set, and the inputs of a block under it."""

    text: str
    change: Callable[[Inputs], Inputs]
    ambient_temperature: float | None = None
    duration: float | None = None


def scaled(text: str, **factors: float) -> Experiment:
    """The same recording with inputs multiplied by these factors."""
    return Experiment(text, lambda x: {name: factor * x[name] for name, factor in factors.items() if name in x})


@dataclass(frozen=True)
class Bench:
    """The laboratory of one measured machine (see ``emafault.gap.next_experiment``)."""

    twin: MeasuredTwin
    experiments: Sequence[Experiment]

    def menu(self) -> Sequence[Experiment]:
        """What could be recorded: a repetition, and whatever changes the inputs of this machine's recordings."""
        usual = self.twin.blocks[self.twin.explore[0]].inputs

        def changes(experiment: Experiment) -> bool:
            return any(not np.array_equal(value, usual[name]) for name, value in experiment.change(usual).items())

        return (scaled("the same once more"), *filter(changes, self.experiments))

    def imagine(
        self, twin: MeasuredTwin, values: np.ndarray, effects: Sequence[str], experiments: Sequence[Experiment]
    ) -> MeasuredTwin:
        """A twin of these recordings, named 0, 1, ...: its first recording that explores, under the new conditions."""
        usual = twin.blocks[twin.explore[0]]
        blocks = {}
        for n, experiment in enumerate(experiments):
            cells = [replace(cell, recording=str(n)) for cell in usual.cells]
            blocks[str(n)] = replace(usual, cells=cells, inputs={**usual.inputs, **experiment.change(usual.inputs)})
        return replace(twin, blocks=blocks, explore=tuple(blocks), confirm=())
