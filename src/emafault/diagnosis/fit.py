"""The fit of a bench: linearise, search, relinearise at what leads, until it stands still."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve

from .evidence import Normal, Reduced, marginalise
from .linear import Weights, White, assemble, correct, key_of, weights_from, whitened
from .model import Parameter, Unit, Variant
from .search import REMAINDER_SIZES, WIDTHS, Candidate, Model, Search

ROUNDS = 5
FIRST = 2  # steps of the unit alone before the search
STILL = 0.3  # prior standard deviations by which the point may still move


@dataclass
class Fit:
    """Where a bench's search ended."""

    values: dict[str, float]  # the point of linearisation
    whites: list[White]
    weights: dict[tuple[str, str], Weights]
    models: list[Model]
    reduced: Reduced
    normal: Normal
    search: Search


class Bench:
    """Recordings of one machine under one linearised model.

    Parameters
    ----------
    machine : gives ``parameters``, ``units`` and ``blocks(values, recordings)``
    recordings : names of those that are fitted
    threads : recordings are linearised side by side
    """

    def __init__(self, machine, recordings: Sequence[str], threads: int = 1):
        self.machine, self.recordings, self.threads = machine, list(recordings), threads
        self.parameters: dict[str, Parameter] = dict(machine.parameters)
        self.units: list[Unit] = list(machine.units)
        self.point = {n: p.off for n, p in self.parameters.items()}
        self.on: set[str] = set()
        self.weights: dict[tuple[str, str], Weights] = {}
        of_unit = {p.name for u in self.units for p in u.parameters}
        mine = set(self.recordings)
        self.nuisances = [
            n
            for n, p in self.parameters.items()
            if n not in of_unit and not p.fixed and p.sd > 0.0 and ("@" not in n or n.split("@", 1)[1] in mine)
        ]
        self.corrected = True

    # ---- linearisation
    def active(self, unit: Unit) -> list[Variant]:
        """Variants of a unit at the present point."""
        if unit.on is not None and unit.id in self.on:
            return [unit.on]
        return list(unit.variants)

    def columns(self) -> tuple[list[str], dict[str, str]]:
        """Names of all columns of units at the present point, and aliases."""
        names, aliases = [], {}
        for unit in self.units:
            for v in self.active(unit):
                for p in v.parameters:
                    names.append(p.name)
                    if p.alias is not None:
                        aliases[p.name] = p.alias
        return names, aliases

    def values(self) -> dict[str, float]:
        """The point as the machine takes it: what lies beyond a tolerance added to its quantity."""
        out = dict(self.point)
        for n, p in self.parameters.items():
            if p.alias is not None:
                out[p.alias] = out.get(p.alias, self.parameters[p.alias].off) + self.point.get(n, 0.0)
        return out

    def linearise(self, names: Sequence[str] | None = None, machine=None) -> list[White]:
        """Whitened blocks at the present point."""
        values = self.values()
        columns, aliases = self.columns()
        wanted = list(dict.fromkeys([*self.nuisances, *[n for n in columns if n not in aliases]]))
        machine = machine or self.machine

        def one(recording: str) -> list[White]:
            out = []
            blocks = machine.blocks(values, recording)
            again = machine.blocks(values, recording, disturbed=True) if self.corrected else [None] * len(blocks)
            for block, other in zip(blocks, again, strict=True):
                block.columns = {n: c for n, c in block.columns.items() if n in wanted}
                white = whitened(block, self.weights.get(key_of(block)), wanted, True)
                if other is not None:
                    correct(white, other, self.weights.get(key_of(block)))
                out.append(white)
            return out

        names = names or self.recordings
        if self.threads > 1 and len(names) > 1:
            with ThreadPoolExecutor(self.threads) as pool:
                found = list(pool.map(one, names))
        else:
            found = [one(n) for n in names]
        return [w for part in found for w in part]

    def normal(self, whites: Sequence[White]) -> Normal:
        """Normal matrix of all columns, remainders among them."""
        columns, aliases = self.columns()
        left = list(dict.fromkeys(n for w in whites for n in w.names if n.startswith("remainder.")))
        return assemble(whites, [*self.nuisances, *columns, *left], aliases)

    def _prior(self, name: str) -> tuple[float, float, float]:
        """Deviation of the prior's mean from the point, its standard deviation, and the deviation that is off."""
        if name.startswith("remainder."):
            return 0.0, 1.0, 0.0
        p = self.parameters[name]
        at = self.point.get(name, p.off)
        return p.mean - at, p.sd, p.off - at

    def reduce(self, normal: Normal) -> Reduced:
        """The nuisances marginalised."""
        prior = {n: self._prior(n) for n in normal.names}
        mean = np.array([prior[n][0] for n in self.nuisances])
        sd = np.array([prior[n][1] for n in self.nuisances])
        fixed = np.array([prior[n][2] for n in normal.names])
        return marginalise(normal, self.nuisances, mean, sd, fixed)

    def nuisance_deviations(self, normal: Normal, given: dict[str, float]) -> dict[str, float]:
        """Deviations of the nuisances where other columns take those given, the rest off."""
        index = normal.index
        n = np.array([index[x] for x in self.nuisances])
        rest = [x for x in normal.names if x not in set(self.nuisances)]
        d = np.array([given.get(x, self._prior(x)[2]) for x in rest])
        r = np.array([index[x] for x in rest])
        mean = np.array([self._prior(x)[0] for x in self.nuisances])
        sd = np.array([self._prior(x)[1] for x in self.nuisances])
        A = normal.H[np.ix_(n, n)] + np.diag(1.0 / sd**2)
        right = mean / sd**2 - normal.g[n] - normal.H[np.ix_(n, r)] @ d
        found = cho_solve(cho_factor(A), right)
        return dict(zip(self.nuisances, found.tolist(), strict=True))

    # ---- candidates
    def candidates(self, reduced: Reduced) -> tuple[list[Unit], dict[tuple[str, int], Candidate]]:
        """Units and remainders of the present point, ready for the search."""
        units = list(self.units)
        out: dict[tuple[str, int], Candidate] = {}
        for unit in self.units:
            for v, variant in enumerate(self.active(unit)):
                names = [p.name for p in variant.parameters]
                index = np.array([reduced.index[n] for n in names])
                prior = [self._prior(n) for n in names]
                signs = np.array(list(variant.signs) or [0] * len(names))
                switch = any(p.mean != p.off for p in variant.parameters) and len(names) == 1
                out[unit.id, v] = Candidate(
                    index, np.array([q[0] for q in prior]), np.array([q[1] for q in prior]), signs,
                    (1.0,) if switch else tuple(w for w in WIDTHS if w >= min(variant.least, 1.0)), names,
                )  # fmt: skip
        equations = dict.fromkeys(n.split(".")[1] for n in reduced.names if n.startswith("remainder."))
        for equation in equations:
            index = np.array([k for k, n in enumerate(reduced.names) if n.startswith(f"remainder.{equation}.")])
            unit = Unit(f"remainder:{equation}", "remainder", (equation,), [Variant([])])
            units.append(unit)
            out[unit.id, 0] = Candidate(
                index, np.zeros(len(index)), np.ones(len(index)), np.zeros(len(index), int), REMAINDER_SIZES,
                [reduced.names[k] for k in index],
            )  # fmt: skip
        return units, out

    # ---- the full model, from which the weights come
    def full(self, normal: Normal) -> dict[str, float]:
        """Deviations with everything free under its prior: what this leaves is noise, or beyond all of the library."""
        names = normal.names
        prior = [self._prior(n) for n in names]
        mean = np.array([0.0 if n not in set(self.nuisances) else q[0] for n, q in zip(names, prior, strict=True)])
        sd = np.array([q[1] for q in prior])
        A = normal.H + np.diag(1.0 / sd**2)
        scale = 1.0 / np.sqrt(np.maximum(np.diag(A), 1.0 / sd**2))
        found = scale * solve(A * np.outer(scale, scale), scale * (mean / sd**2 - normal.g), assume_a="sym")
        return dict(zip(names, found.tolist(), strict=True))

    def reweigh(self, whites: Sequence[White], normal: Normal) -> None:
        """Weights of every block from the full model's residual."""
        deviations = self.full(normal)
        _, aliases = self.columns()
        for n, alias in aliases.items():
            deviations[alias] = deviations.get(alias, 0.0) + deviations.pop(n)
        for w in whites:
            self.weights[key_of(w.block)] = weights_from(w, deviations, self.weights.get(key_of(w.block)))

    # ---- the whole
    def move(self, model: Model, normal: Normal) -> float:
        """Move the point to a model's fit; returns the largest step in prior standard deviations."""
        given = {n: d for n, d in model.deviations.items()}
        nuisance = self.nuisance_deviations(normal, given)
        largest = 0.0
        for n, d in nuisance.items():
            largest = max(largest, abs(d) / self.parameters[n].sd)
            self.point[n] += d
        inside = {c.unit: c for c in model.choices}
        on: set[str] = set()
        for unit in self.units:
            if unit.id not in inside:
                for p in unit.parameters:
                    self.point[p.name] = p.off
                continue
            variant = self.active(unit)[inside[unit.id].variant]
            for p in variant.parameters:
                d = given.get(p.name, 0.0)
                if p.secant is not None:
                    self._switch_on(unit, p, d)
                    largest = 1.0
                else:
                    largest = max(largest, abs(d) / p.sd)
                    if unit.on is not None and unit.id in self.on and len(unit.variants) > 1:
                        d = float(np.clip(d, -p.sd, p.sd))  # what is not linear is approached in steps
                    self.point[p.name] = self.point.get(p.name, p.off) + d
            on.add(unit.id)
        self.on = on
        return largest

    def _switch_on(self, unit: Unit, p: Parameter, amount: float) -> None:
        """An effect found along a secant gets parameters of its own."""
        assert unit.on is not None and p.secant is not None
        amount = float(np.clip(amount, 0.2, 5.0))
        first = True
        for own in unit.on.parameters:
            at = p.secant.get(own.name, own.mean)
            self.point[own.name] = own.off + (at - own.off) * amount if first else at
            first = False

    def fit(self, warm: bool = False) -> Fit:
        """Search and relinearise until the leading set stands still; ``warm`` begins at the point as it is."""
        whites = self.linearise()
        normal = self.normal(whites)
        # the unit first: its nuisances move the point before anything is compared
        for _ in range(1 if warm else FIRST):
            if not warm:
                self.move(Model((), 0.0, 0.0, {}, {}), normal)
            self.reweigh(whites, normal)
            whites = self.linearise()
            normal = self.normal(whites)
        leading: tuple[str, ...] = ()
        search = self._search(normal)
        for _ in range(ROUNDS):
            best = search.ranked()[0]
            step = self.move(best, normal)
            if best.units == leading and step < STILL:
                break
            leading = best.units
            self.reweigh(whites, normal)
            whites = self.linearise()
            normal = self.normal(whites)
            search = self._search(normal)
        return Fit(dict(self.point), whites, self.weights, search.ranked(), search.reduced, normal, search)

    def _search(self, normal: Normal) -> Search:
        reduced = self.reduce(normal)
        units, candidates = self.candidates(reduced)
        search = Search(reduced, units, candidates)
        search.run()
        return search
