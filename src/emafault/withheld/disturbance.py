"""What a disturbance is: something that no catalogue lists, put in by the generator's side.

Each is one short function of its size and a random generator. It draws what it is and says what the key tells of it;
it acts on the recorded signals (``measuring.py``) or in the simulated physics (``acting.py``). ``inside`` ones are of a
form that a grammar of such things has, ``outside`` ones are of none.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

Signals = dict[str, np.ndarray]  # channel -> (time,) or (time, phase); ``time`` (s) among them
Change = Callable[[Signals, np.random.Generator], None]


@dataclass(frozen=True)
class Acting:
    """One disturbance drawn: where it is and what it does.

    ``change`` alters the recorded signals of one recording in place, with that recording's own random generator;
    ``terms`` gives the rows of ``actuator.unlisted`` of one recording, and the table that one follows which wanders.
    """

    equation: tuple[str, ...]  # any of them is right
    parameters: Mapping[str, tuple[float, str]]  # true value and unit, named as a verdict names them
    change: Change | None = None
    terms: Callable[[float, np.random.Generator], tuple[Sequence[np.ndarray], np.ndarray | None]] | None = None


@dataclass(frozen=True)
class Kind:
    """A disturbance as it is registered. ``at_sight``: one look at the samples tells it, whatever its size."""

    name: str
    inside: bool
    form: str | None
    along: tuple[str, ...]
    draw: Callable[[float, np.random.Generator], Acting]
    at_sight: bool = False


@dataclass
class Register:
    """Disturbances by name, filled by the decorators below."""

    kinds: dict[str, Kind] = field(default_factory=dict)

    def inside(self, form: str, *along: str, at_sight: bool = False):
        """Register a function whose disturbance has a form, along a coordinate of which any given is right."""
        return self._adding(form, along, at_sight)

    def outside(self, *along: str):
        """Register a function whose disturbance has no form."""
        return self._adding(None, along, False)

    def _adding(self, form: str | None, along: tuple[str, ...], at_sight: bool):
        def add(draw: Callable[[float, np.random.Generator], Acting]):
            name = draw.__name__
            self.kinds[name] = Kind(name, form is not None, form, along, draw, at_sight)
            return draw

        return add


def letter(rng: np.random.Generator) -> tuple[int, str]:
    """A phase drawn: its number and its letter."""
    j = int(rng.integers(3))
    return j, "abc"[j]
