"""Recordings whose equations are looked through for what no catalogue lists."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from .described import Described, with_forms
from .forms import function
from .model import LISTED
from .scanning import proposed, refined
from .search import NEAR, Search
from .sets import Model
from .settling import Settling

SCANNED = 30_000  # samples that are looked through for forms, or more where few recordings hold them
SPREAD = 3  # recordings that they are of at least
FEWEST, MOST = 2, 5  # forms proposed by scans that a set may have: at first, and where they leave no remainder


class Describing(Settling):
    """Recordings of one machine, with the forms that scans of them have proposed."""

    describing = True  # whether recordings are long enough to tell forms and the colour of the noise from each other

    def __init__(self, machine, recordings: Sequence[str], processes: int = 1):
        super().__init__(with_forms(machine, getattr(machine, "forms", ())), recordings, processes)
        self.scanned = FEWEST  # forms proposed by scans that a set may have
        self._spans: dict[str, dict[tuple[str, str], tuple[float, float]]] = {}  # by recording, see ``_ranges``

    def describe(self, forms: Sequence[Described]) -> None:
        """Take described forms among the candidate causes."""
        if tuple(forms) == self.described:
            return
        self.machine = with_forms(self.machine, forms)
        self.parameters = dict(self.machine.parameters)
        self.units = list(self.machine.units)
        self.point = {n: p.off for n, p in self.parameters.items()} | self.point
        if self.workers is not None:
            self.workers.tell("describe", tuple(forms))

    def _describe(self, mark: str) -> bool:
        """Look through what the present point leaves for forms; whether there are any."""
        if not self.describing:
            return False
        names, workers = self._looked_through(), self._workers()
        carried = {n: self.carried[n] for n in names}
        # what stands out is what no listed effect could be, whether or not it acts yet
        values, free = self.values(), self._free({u.id for u in self.units if u.kind in LISTED} | self.on)
        parts = [(values, names, carried, free, mark, k, workers.count) for k in range(workers.count)]
        found = proposed(self.machine, [f for part in workers.map("scan", parts) for f in part])
        found = [f for f in found if not any(f.same(g) for g in self.described)]
        self.describe([*self.described, *map(self._over_all, found)])
        return bool(found)

    def _over_all(self, form: Described) -> Described:
        """A function over the whole range of its coordinate, over that which all recordings have of it: beyond its ends
        it would be constant. Its coefficients at the point are then those of the same function."""
        if form.word != "function":
            return form
        wide = replace(form, shape=function.widened(form.shape, self._ranges(form.shown)))
        names = form.names(self.recordings[0])
        here = np.array([self.point.get(n, 0.0) for n in names])
        if here.any():
            self.point |= dict(zip(names, function.converted(here, form.values, wide.values).tolist(), strict=True))
        return wide

    def _ranges(self, equation: str) -> dict[str, tuple[float, float]]:
        """Least and largest value, over all recordings, of what an equation's rows lie along."""
        for name in self.recordings:
            if name not in self._spans:
                blocks = self.machine.blocks(self.values(), name, wanted=())
                self._spans[name] = {
                    (b.equation, n): (float(np.min(b.coordinates[n])), float(np.max(b.coordinates[n])))
                    for b in blocks for n in function.COORDINATES if n in b.coordinates
                }  # fmt: skip
        ends = [self._spans[name] for name in self.recordings]
        of = {n for e in ends for q, n in e if q == equation}
        every = {n: [e[equation, n] for e in ends if (equation, n) in e] for n in of}
        return {n: (min(low for low, _ in e), max(high for _, high in e)) for n, e in every.items()}

    def _free(self, units: Collection[str]) -> dict[str, tuple[float, float]]:
        """What is free beside a form: nuisances and parameters of some units, by name of a column."""
        names = [p.name for u in self.units if u.id in units for v in self.active(u) for p in v.parameters]
        return self._full_prior(names, self.columns()[1])

    def _lacking(self, search: Search) -> bool:
        """Whether the leading set has a remainder where a form acts that a scan proposed."""
        leading = search.ranked()[0].units
        places = {q for f in self.described if f.id in leading for q in (f.equation, f.seen)}
        return any(u.removeprefix("remainder:") in places for u in leading if u.startswith("remainder:"))

    def _count_scanned(self, search: Search) -> int:
        """Forms that scans proposed in the leading set."""
        return len({f.id for f in self.described}.intersection(search.ranked()[0].units))

    def _keep_likely(self, search: Search) -> None:
        """Let go of described forms that no likely set has, but for those of the leading set in other channels.

        What comes into one phase's channel, hum say, may be in another's too, where no scan would find it alone.
        """
        ranked = search.ranked()
        likely = {u for m in ranked if m.log_posterior > ranked[0].log_posterior - NEAR for u in m.units}
        shapes = {(f.word, f.shape) for f in self.described if f.channel and f.id in ranked[0].units}
        kept = [f for f in self.described if f.id in likely or (f.channel and (f.word, f.shape) in shapes)]
        self.describe(kept)

    def _looked_through(self) -> list[str]:
        """As many recordings as a scan needs."""
        out: list[str] = []
        samples = 0
        for name in [*self.recordings[::2], *self.recordings[1::2]]:
            if samples > SCANNED and len(out) >= SPREAD:
                break
            samples += self.machine.samples(name)
            out.append(name)
        return out

    def _refine(self, model: Model) -> bool:
        """Give described forms of a set, fitted at the present point, the shape that is best there; whether any
        changes."""
        mine = [f for f in self.described if f.id in model.units]
        if not mine:
            return False
        values, free = self.values(), self._free(self.on)
        blocks = [b for n in self._looked_through() for b in self.machine.blocks(values, n, wanted=set(free))]
        better = {f.id: refined(self.machine, f, blocks, self.carried, self.point, free) for f in mine}
        before = self.described
        self.describe([better.get(f.id, f) for f in before])
        return self.described != before
