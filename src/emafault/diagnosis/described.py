"""Described forms as candidate causes: columns like every other unit's."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .forms import FORMS, function
from .left import Known
from .model import Block, Parameter, Unit, Variant

SAME = 4.0  # standard deviations
IMPLICIT = 4  # iterations, each of which makes the error smaller by the slope of the wave
ALSO = "_also"  # after the id of a form that differs from one by a constant
SPAN = 10.0  # widest prior of a coefficient over the noise of a row


@dataclass(frozen=True)
class Described:
    """A form in one equation: its word, the driver that it multiplies and its shape."""

    id: str  # of its unit
    word: str
    equation: str
    driver: int
    shape: Known
    scale: float  # of its coefficients
    among: float  # alternatives that the scan could have told from it
    seen: str = ""  # equation whose scan has found it, where it acts in several
    channel: str = ""  # of the measuring chain, or a coefficient: what several equations have it through

    @property
    def values(self) -> dict[str, float]:
        """Its shape by name."""
        return {n: v for n, v, _, _ in self.shape}

    @property
    def shown(self) -> str:
        """The equation whose rows it has been found along."""
        return self.seen or self.equation

    @property
    def possible(self) -> bool:
        """Whether its sizes are above zero and its ends in their order."""
        form, values = FORMS[self.word], self.values
        ends = [values[n] for n in form.ENDS]
        return all(values[n] > 0.0 for n in form.POSITIVE) and ends == sorted(set(ends))

    def same(self, other: "Described") -> bool:
        """Whether it is another where this one is, its shape no further than scans of both may be off."""
        if (self.word, self.equation, self.channel) != (other.word, other.equation, other.channel):
            return False
        if not self.channel and self.driver != other.driver:  # which has shown a channel's form is all the same
            return False
        pairs = zip(self.shape, other.shape, strict=True)
        return all(abs(a[1] - b[1]) <= SAME * np.hypot(a[2], b[2]) + 1e-9 * abs(a[1]) for a, b in pairs)

    def sharper(self, other: "Described") -> bool:
        """Whether its shape is known better than that of another, the same one."""
        return all(a[2] < b[2] for a, b in zip(self.shape, other.shape, strict=True))

    def names(self, recording: str) -> list[str]:
        """Its parameters as a recording has them."""
        form = FORMS[self.word]
        return [f"form.{self.id}.{c}" + (f"@{recording}" if form.EACH else "") for c in form.COEFFICIENTS]

    def unit(self, recordings: Sequence[str]) -> Unit:
        """A candidate cause."""
        each = [n for r in (recordings if FORMS[self.word].EACH else recordings[:1]) for n in self.names(r)]
        parameters = [Parameter(n, 0.0, 0.0, SPAN * self.scale) for n in each]
        same_as = self.id.removesuffix(ALSO) if self.id.endswith(ALSO) else ""
        variants, equations = [Variant(parameters)], (self.equation,)
        return Unit(self.id, "form", equations, variants, among=self.among, proposed=True, same_as=same_as)

    def known(self, block: Block) -> np.ndarray | None:
        """(row,) where a block says something of the form, or does not need to; None: everywhere."""
        return function.within(block.coordinates, self.shape) if self.word == "function" else None

    def columns(self, block: Block) -> np.ndarray:
        """(column, row) of a block: the derivatives of its residual."""
        rows = FORMS[self.word].columns(block.coordinates, self.values)
        return -rows * np.asarray(block.coordinates["drivers"][self.driver])


class WithForms:
    """A machine whose equations have described forms too."""

    def __init__(self, machine, forms: Sequence[Described], known: "dict[tuple, np.ndarray] | None" = None):
        self.machine, self.forms = machine, tuple(forms)
        more = [f.unit(list(machine.recordings)) for f in self.forms]
        self.units = [*machine.units, *more]
        self.parameters = {**machine.parameters, **{p.name: p for u in more for p in u.parameters}}
        self.known: dict[tuple, np.ndarray] = {} if known is None else known

    def __getattr__(self, name: str):
        return getattr(self.machine, name)

    def having(self, forms: Sequence[Described]) -> "WithForms":
        """The same machine with other forms."""
        return WithForms(self.machine, forms, self.known)

    def blocks(
        self, values: Mapping[str, float], name: str, disturbed: bool = False, wanted: Collection[str] | None = None
    ) -> list[Block]:
        """See the machine: its blocks, with the forms' columns and what their present coefficients take out."""
        less = self._undone(values, name)
        more = {"less": less} if less else {}
        blocks = self.machine.blocks(values, name, disturbed=disturbed, wanted=wanted, **more)
        for block in blocks:
            for form in self.forms:
                if not form.channel and form.equation != block.equation:
                    continue
                known = form.known(block)
                if known is not None:
                    block.usable = block.usable & known
                names = form.names(block.recording)
                here = np.array([values.get(n, 0.0) for n in names])
                if not here.any() and wanted is not None and not set(names) & set(wanted):
                    continue
                columns = self.columns(form, block, values)
                if columns is None or not columns.any():
                    continue
                if form.channel not in less:
                    block.residual = block.residual + here @ columns
                block.columns |= dict(zip(names, columns, strict=True))
        return blocks

    def _undone(self, values: Mapping[str, float], recording: str) -> dict[str, np.ndarray]:
        """By channel whose forms are taken off its signal, what their present coefficients say is wrong of it."""
        out: dict[str, np.ndarray] = {}
        for channel in dict.fromkeys(f.channel for f in self.forms):
            if channel in getattr(self.machine, "undone", ()):
                mine = [f for f in self.forms if f.channel == channel]
                own = {f: np.array([values.get(n, 0.0) for n in f.names(recording)]) for f in mine}
                acting = {f: here for f, here in own.items() if here.any()}
                if acting:
                    out[channel] = self.wrong(recording, channel, acting)
        return out

    def wrong(self, recording: str, channel: str, acting: Mapping[Described, np.ndarray]) -> np.ndarray:
        """(sample,) what forms with these coefficients make wrong of a recording's channel.

        A wave of the recorded angle goes along the true one, which is found from it by fixed-point iteration.
        """
        x = np.zeros(0)
        for _ in range(IMPLICIT):
            along = self.machine.sampled(recording, channel, x)
            before, x = x, np.sum([c @ FORMS[f.word].columns(along, f.values) for f, c in acting.items()], axis=0)
            if np.array_equal(before, x):
                break
        return x

    def columns(self, form: Described, block: Block, values: Mapping[str, float]) -> np.ndarray | None:
        """(column, row) of a form in a block at a point; None where it does not act there."""
        if form.channel and (form.channel, block.equation) in self.machine.moving:
            less = self._undone(values, block.recording)
            along = self.machine.sampled(block.recording, form.channel, less.get(form.channel))
            x = FORMS[form.word].columns(along, form.values)
            return self.machine.seen_at(values, block.recording, block.equation, x, less)
        key = block.recording, block.equation, form.id, form.shape
        if key not in self.known:
            if getattr(self.machine, "large", False):  # of one recording at a time
                for other in [k for k in self.known if k[0] != block.recording]:
                    del self.known[other]
            if form.channel:
                x = FORMS[form.word].columns(self.machine.sampled(block.recording, form.channel), form.values)
                for equation, rows in self.machine.seen_in(form.channel, block.recording, x).items():
                    self.known[block.recording, equation, form.id, form.shape] = rows
            else:
                self.known[key] = form.columns(block)
        return self.known.get(key)


def with_forms(machine, forms: Sequence[Described]) -> WithForms:
    """A machine with these forms in the place of those that it has, if any; what it knows of their columns is kept."""
    if not isinstance(machine, WithForms):
        return WithForms(machine, forms)
    kept = {(f.id, f.shape) for f in forms}
    for key in [k for k in machine.known if k[2:] not in kept]:
        del machine.known[key]
    return WithForms(machine.machine, forms, machine.known)


def without(machine: WithForms, form: Described, blocks: Sequence[Block], values: Mapping[str, float]) -> list[Block]:
    """Blocks with what a form's coefficients take out of them put back."""
    out = []
    for b in blocks:
        here = np.array([values.get(n, 0.0) for n in form.names(b.recording)])
        columns = machine.columns(form, b, values)
        out.append(b if columns is None else replace(b, residual=b.residual - here @ columns))
    return out
