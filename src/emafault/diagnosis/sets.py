"""Sets of listed effects, described forms and remainders: what is in them, and their posterior probabilities."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

OTHER_FORM = 100  # added to a variant's number, once for each kind of own form that the unit may take
WIDTHS = (1.0, 0.3, 0.1, 0.03)  # of an amplitude's prior over its range
FORM_WIDTHS = (1.0, 0.3, 0.1, 0.03, 0.01)  # of a described form's, whose range no catalogue gives
REMAINDER_SIZES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)  # over the noise of a row


@dataclass(frozen=True)
class Choice:
    """One unit in a set: which of its variants, how wide its prior."""

    unit: str
    variant: int
    width: float


@dataclass
class Model:
    """A set with its log posterior (up to a constant), fitted deviations and their standard deviations; before it is
    fitted, the choices alone."""

    choices: tuple[Choice, ...]
    log_posterior: float = 0.0
    log_likelihood: float = 0.0
    deviations: dict[str, float] = field(default_factory=dict)
    spread: dict[str, float] = field(default_factory=dict)

    @cached_property
    def units(self) -> tuple[str, ...]:
        """Ids, sorted."""
        return tuple(sorted(c.unit for c in self.choices))


@dataclass
class Candidate:
    """A unit's variant ready for the linear model: indices, prior deviation and standard deviation, sides."""

    index: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    signs: np.ndarray
    widths: tuple[float, ...]
    names: list[str]
    hole: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))  # its edges in standard deviations from off
    within: np.ndarray = field(default_factory=lambda: np.zeros(0))  # tolerance, in the same
    extra: np.ndarray = field(default_factory=lambda: np.zeros(0, int))  # own form
    extra_sd: np.ndarray = field(default_factory=lambda: np.zeros(0))


def inclusion(models: Sequence[Model]) -> dict[str, float]:
    """Marginal posterior probability of each unit over the sets seen."""
    weights = posterior(models)
    out: dict[str, float] = {}
    for m, w in zip(models, weights, strict=True):
        for u in m.units:
            out[u] = out.get(u, 0.0) + float(w)
    return out


def posterior(models: Sequence[Model]) -> np.ndarray:
    """(model,) probabilities."""
    logs = np.array([m.log_posterior for m in models])
    w = np.exp(logs - logs.max())
    return w / w.sum()
