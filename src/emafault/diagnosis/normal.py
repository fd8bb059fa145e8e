"""Normal equations of a bench at its point: linearised, assembled, and the step that a set would take."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import repeat

import numpy as np

from .bounded import minimum_within
from .evidence import Definite, Normal, Reduced, marginalise
from .forked import Workers
from .linear import OWN_FORM, OWN_SHARES, OwnForm, White, assemble, full_model, function_of, white_rows
from .linearisation import Carried, Linearisation, Task
from .model import SETTINGS, Parameter, Unit, Variant
from .point import Point, in_values, is_parameter
from .sets import FORM_WIDTHS, OTHER_FORM, REMAINDER_SIZES, WIDTHS, Candidate, Model


class NormalEquations(Point):
    """Recordings of one machine under one linearised model.

    Parameters
    ----------
    machine : gives ``parameters``, ``units``, ``blocks(values, recordings)``, and ``families(equation)`` and
        ``own_families(equation)``: sets of functions of its remainder and of an own form that go along one coordinate
    recordings : names of those that are fitted
    processes : in which recordings are linearised side by side
    """

    def __init__(self, machine, recordings: Sequence[str], processes: int = 1):
        super().__init__(machine, recordings)
        self.processes = processes
        self.carried: dict[str, Carried] = {}
        self.workers: Workers | None = None
        self.remainders: dict[str, Unit] = {}
        self.instead: dict[str, float] = {}  # the point, had the last step added to factors and not multiplied them
        self.sizes: dict[str, dict[str, float]] = {}  # of the units that carry their own form
        self.unreached = 0.0  # log evidence that the last step's linear model has where nuisances may not go

    def linearise(
        self,
        model: Model | None = None,
        renew: bool = False,
        corrected: bool = True,
        leading: Mapping[str, float] | None = None,
    ) -> list[White]:
        """Normal matrices of all blocks at the present point, with every column, or with those that a model has.

        ``renew`` takes the weights from what a full model leaves there, ``leading`` from what the leading one does, by
        its ``own_deviations``. ``corrected`` takes out what the noise in the regressors adds.
        """
        task = self._task(model, corrected)
        if leading is not None:
            return self._each(replace(task, full=leading, leads=True), self.recordings)
        if not renew:
            return self._each(task, self.recordings)
        whites = self._each(replace(task, again=True), self.recordings)
        full = full_model(whites, self._full_prior(*self._columns_of(model)))
        return self._each(replace(task, full=full), self.recordings)

    def own_deviations(self, model: Model, normal: Normal) -> dict[str, float]:
        """Deviations of columns from the present point in a model, the nuisances fitted beside it; what the point has
        and the model has not is off."""
        out = self.nuisance_deviations(normal, model.deviations)
        off = {n: self.prior(n)[2] for n in normal.names if n not in out}
        given = {n: d for n, d in off.items() if d != 0.0} | model.deviations
        for n, d in given.items():
            own = self.parameters[n].alias or n if is_parameter(n) else n
            out[own] = out.get(own, 0.0) + d
        return out

    def _task(self, model: Model | None, corrected: bool) -> Task:
        """What is to be linearised at the present point: every column and remainder, or those that a model has."""
        columns, aliases = self._columns_of(model)
        wanted = tuple(dict.fromkeys([*self.nuisances, *[aliases.get(n, n) for n in columns]]))
        left = None
        if model is not None:
            left = frozenset(u.split(":", 1)[1] for u in model.units if u.startswith("remainder:"))
        return Task(self.values(), wanted, left, self.own_forms(model), corrected=corrected, on=frozenset(self.on))

    def _columns_of(self, model: Model | None) -> tuple[list[str], dict[str, str]]:
        """Columns of units, all or those of a model, and aliases."""
        columns, aliases = self.columns()
        if model is not None:
            inside = {n for c in model.choices for n in self.names_of(c)}
            columns = [n for n in columns if n in inside]
        return columns, aliases

    def _full_prior(self, columns: Sequence[str], aliases: Mapping[str, str]) -> dict[str, tuple[float, float]]:
        """Mean and standard deviation of deviations with everything free, an alias's width added to its quantity's."""
        out = {n: self.prior(n)[:2] for n in self.nuisances}
        for n in columns:
            sd = self.prior(n)[1]
            own = aliases.get(n, n)
            before = out.get(own, (0.0, 0.0))
            # in the full model an effect has the prior's width around where it is
            out[own] = (before[0], float(np.hypot(before[1], sd)))
        return out

    def _each(self, task: Task, names: Sequence[str]) -> list[White]:
        """A task done for recordings, side by side where there are processes; takes over what they carry."""
        workers = self._workers()
        calls = []
        for n in names:
            carried = self.carried.setdefault(n, {})
            calls.append((task, n, None if workers.sent.get(n) is carried else carried))
        found = workers.map("compress", calls, [self.recordings.index(n) for n in names])
        self.carried |= {n: renewed for n, (_, renewed) in zip(names, found, strict=True) if renewed is not None}
        workers.sent |= {n: self.carried[n] for n in names}
        return [w for whites, _ in found for w in whites]

    def _workers(self) -> Workers:
        """Processes that share the machine as it is at the first call."""
        if self.workers is None:
            several, values = min(self.processes, len(self.recordings)), self.values()
            for name in self.recordings if several > 1 else ():
                self.machine.prepare(name, values)
            if several > 1:
                Linearisation.load()
            self.workers = Workers(self, Linearisation(self.machine), several)
        return self.workers

    def signals(self, deviations: Mapping[str, float]) -> list[tuple[str, np.ndarray, Mapping[str, np.ndarray]]]:
        """Equation, (row,) what deviations add to each block in units of its noise, and what its rows lie along."""
        _, aliases = self.columns()
        wanted = list(dict.fromkeys(aliases.get(n, n) for n in deviations if is_parameter(n)))
        out = []
        for name in self.recordings:
            for block in self.machine.blocks(self.values(), name, wanted=set(wanted)):
                names, rows = white_rows(block, wanted, any(n.startswith("remainder.") for n in deviations))
                d = np.array([deviations.get(n, 0.0) for n in names])
                out.append((block.equation, rows[:, :-1] @ d, block.coordinates))
        return out

    def own_forms(self, model: Model | None = None) -> dict[str, OwnForm]:
        """Units that carry their own form, all or those of a model."""
        out = {}
        beside = getattr(self.machine, "own_parameters", {})  # by unit, what else an own form may have
        for unit in self.units:
            if unit.id not in self.sizes or (model is not None and unit.id not in model.units):
                continue
            sizes = self.sizes[unit.id]
            if unit.id in self.on:  # of what the point holds: an effect of no size has no form
                here = self.active(unit)[0].parameters if unit.on is not None else unit.parameters
                sizes = self.sizes[unit.id] = {p.name: -self.prior(p.name)[2] for p in here}
            own = {self.parameters[n].alias or n: d for n, d in sizes.items()}
            # the prior of every column of an own form is OWN_FORM wide: of these as wide as their own
            out[unit.id] = OwnForm(own, {n: self.parameters[n].sd / OWN_FORM for n in beside.get(unit.id, ())})
        return out

    def normal(self, whites: Sequence[White], model: Model | None = None) -> Normal:
        """Normal matrix of all columns, or of those that a model has, remainders among them."""
        columns, aliases = self._columns_of(model)
        left = list(dict.fromkeys(n for w in whites for n in w.names if not is_parameter(n)))
        return assemble(whites, [*self.nuisances, *columns, *left], aliases)

    def reduce(self, normal: Normal, but: Collection[str] = ()) -> Reduced:
        """The nuisances marginalised, ``but`` for some."""
        prior = {n: self.prior(n) for n in normal.names}
        free = [n for n in self.nuisances if n not in but]
        mean, sd = (np.array([prior[n][k] for n in free]) for k in (0, 1))
        return marginalise(normal, free, mean, sd, np.array([prior[n][2] for n in normal.names]))

    def nuisance_deviations(self, normal: Normal, given: Mapping[str, float]) -> dict[str, float]:
        """Deviations of the nuisances where other columns take those given, the rest off."""
        index = normal.index
        n = np.array([index[x] for x in self.nuisances], int)
        rest = [x for x in normal.names if x not in set(self.nuisances)]
        d = np.array([given.get(x, self.prior(x)[2]) for x in rest])
        r = np.array([index[x] for x in rest], int)
        mean, sd = np.array([self.prior(x)[:2] for x in self.nuisances]).T
        A = normal.H[np.ix_(n, n)] + np.diag(1.0 / sd**2)
        right = mean / sd**2 - normal.g[n] - normal.H[np.ix_(n, r)] @ d
        return dict(zip(self.nuisances, Definite(A).solve(right).tolist(), strict=True))

    def step(self, model: Model, normal: Normal) -> tuple[dict[str, float], float]:
        """Deviations of the nuisances and of a model's columns at its fit, within where priors have any mass and no
        further than one step may go; and the log evidence that is gained there by the columns that are parameters.

        Columns beside the point, which the set is linear in, are at their best before the step too.
        """
        names = [*self.nuisances, *model.deviations]
        low, high = self._ends(model, names)
        mean = np.array([self.prior(n)[0] for n in names])
        sd = self.widths(names, model)
        inside = set(names)
        rest = [n for n in normal.names if n not in inside]
        d = np.array([self.prior(n)[2] for n in rest])
        f, r = (np.array([normal.index[n] for n in of], int) for of in (names, rest))
        A = normal.H[np.ix_(f, f)] + np.diag(1.0 / sd**2)
        right = mean / sd**2 - normal.g[f] - normal.H[np.ix_(f, r)] @ d

        def gain(x: np.ndarray) -> float:
            return float(right @ x - 0.5 * x @ A @ x)

        found = minimum_within(A, right, low, high)
        k = np.arange(len(names)) < len(self.nuisances)
        self.unreached = 0.0
        if np.any(k & ((found <= low) | (found >= high))):
            anywhere = minimum_within(A, right, np.where(k, -np.inf, low), np.where(k, np.inf, high))
            self.unreached = gain(anywhere) - gain(found)
        return dict(zip(names, found.tolist(), strict=True)), gain(found) - self.gained_beside(model, normal)

    def _ends(self, model: Model, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """(column,) least and largest deviations that a step may take columns of a model to: what has one side of off
        stays on it, and what is not linear is approached in steps."""
        ends = {n: self._reach_of(n) for n in self.nuisances}
        units = {u.id: u for u in self.units}
        for c in (c for c in model.choices if c.unit in units):
            unit = units[c.unit]
            bent = unit.on is not None and unit.id in self.on and len(unit.variants) > 1
            variant = self.active(unit)[c.variant % OTHER_FORM]
            for p, side in zip(variant.parameters, variant.signs or repeat(0), strict=False):
                if p.secant is None:
                    off, most = self.prior(p.name)[2], p.sd if bent else np.inf
                    ends[p.name] = (max(off, -most) if side > 0 else -most, min(off, most) if side < 0 else most)
        every = np.array([ends.get(n, (-np.inf, np.inf)) for n in names], float).reshape(-1, 2)
        for k, n in enumerate(names):
            if is_parameter(n) and self.parameters[n].vanishes is not None:
                u = abs(self._factor(n)[0])
                every[k] = np.clip(every[k], -u, u)
        return every[:, 0], every[:, 1]

    def widths(self, columns: Sequence[str], model: Model) -> np.ndarray:
        """(column,) standard deviations of the priors that a model's columns have in it, or nuisances have."""
        width = {c.unit: c.width for c in model.choices}
        of = {n: c.unit for c in model.choices for n in self.names_of(c)}
        of |= {n: f"remainder:{n.split('.')[1]}" for n in columns if n.startswith("remainder.")}
        return np.array([self.prior(n)[1] * width.get(of.get(n, ""), 1.0) for n in columns])

    # ---- candidates
    def candidates(self, reduced: Reduced) -> tuple[list[Unit], dict[tuple[str, int], Candidate]]:
        """Units and remainders of the present point, ready for the search."""
        out: dict[tuple[str, int], Candidate] = {}
        owns: dict[str, list[int]] = {}
        for k, n in enumerate(reduced.names):
            if n.startswith("own."):
                owns.setdefault(n.split(".")[1], []).append(k)
        for unit in self.units:
            own = np.array(owns.get(unit.id, ()), int)
            widths = FORM_WIDTHS if unit.kind == "form" else WIDTHS
            for v, variant in enumerate(self.active(unit)):
                names = [p.name for p in variant.parameters]
                if not all(n in reduced.index for n in names):
                    continue
                index = np.array([reduced.index[n] for n in names])
                prior = [self.prior(n) for n in names]
                signs = np.array(list(variant.signs) or [0] * len(names))
                switch = any(p.mean != p.off for p in variant.parameters) and len(names) == 1
                plain = Candidate(
                    index, np.array([q[0] for q in prior]), np.array([q[1] for q in prior]), signs,
                    (1.0,) if switch else tuple(w for w in widths if w >= min(variant.least, 1.0)), names,
                    self._hole(variant), np.array([self._tolerance(p) for p in variant.parameters]),
                )  # fmt: skip
                out[unit.id, v] = plain
                wide = self._as_wide_as_sized(unit.id, plain) if len(own) else ()
                for k, (share, inside) in enumerate(self._own_kinds(reduced, own), start=1):
                    own_sd = np.full(len(inside), share * OWN_FORM)
                    out[unit.id, v + k * OTHER_FORM] = replace(plain, widths=wide, extra=inside, extra_sd=own_sd)
        left: dict[str, tuple[list[int], list[int]]] = {}
        for k, n in enumerate(reduced.names):
            if n.startswith("remainder."):
                left.setdefault(n.split(".")[1], ([], []))["@" in n].append(k)
        for equation, kinds in left.items():
            # the same in all recordings, or another in each; a controller's coefficients are its own business in both
            same, another = kinds
            if equation in SETTINGS and another:
                another = [*another, *(k for k in same if reduced.names[k].split(".")[2] != "0")]
            each = [np.array(k) for k in (same, another) if k]
            if kinds[0]:
                where = {k: reduced.names[k].split(".")[2:] for k in kinds[0]}
                for family in self.machine.families(equation):
                    each.append(np.array([k for k, (d, f) in where.items() if d == "0" and int(f) in family]))
            unit = Unit(f"remainder:{equation}", "remainder", (equation,), [Variant([])] * len(each))
            self.remainders.setdefault(unit.id, unit)
            for v, index in enumerate(each):
                out[unit.id, v] = Candidate(
                    index, np.zeros(len(index)), np.ones(len(index)), np.zeros(len(index), int), REMAINDER_SIZES,
                    [reduced.names[k] for k in index],
                )  # fmt: skip
        return [*self.units, *self.remainders.values()], out

    def _as_wide_as_sized(self, unit: str, plain: Candidate) -> tuple[float, ...]:
        """Widths of a unit's prior that leave room for the size to which its own form is in proportion: under a
        narrower one the form would stand in for the unit."""
        sizes = self.sizes.get(unit, {})
        sized = [k for k, n in enumerate(plain.names) if n in sizes]
        from_mean = [abs(sizes[n] + self.prior(n)[2] - plain.mean[k]) for k, n in enumerate(plain.names) if n in sizes]
        most = float(np.max(from_mean / plain.sd[sized], initial=0.0))
        nearest = min(plain.widths, key=lambda w: abs(np.log(w / most))) if most > 0.0 else 0.0
        return tuple(w for w in plain.widths if w >= nearest)

    def _own_kinds(self, reduced: Reduced, own: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """Share of the largest own form and columns of each kind of own form: along every coordinate, or along one."""
        if not len(own):
            return []
        every = [own]
        beside = [k for k in own.tolist() if function_of(reduced.names[k]) is None]
        if beside:
            every.append(np.array(beside, int))
        where = {k: reduced.names[k].split(".")[2:] for k in own.tolist() if k not in beside}
        of = {e: self.machine.own_families(e) for e in dict.fromkeys(e for e, _ in where.values())}
        if of and all(of.values()):
            every.append(np.array([k for k, (_, f) in where.items() if f == "0"], int))  # by equation
            for n in range(min(map(len, of.values()))):
                every.append(np.array([k for k, (e, f) in where.items() if int(f) in of[e][n]], int))
        return [(share, inside) for inside in every for share in OWN_SHARES]

    def _hole(self, variant: Variant) -> np.ndarray:
        """(2, parameter) edges of the hole in its prior, in the deviations' standard deviations."""
        edges = np.array([-1.0, 1.0])[:, None] * np.array(variant.hole)
        for k, p in enumerate(variant.parameters if edges.size else ()):
            if p.vanishes is not None:  # the tolerance is one of the value, the deviation that of its logarithm
                share = p.sd / abs(self.parameters[p.alias or p.name].off - p.vanishes)
                u = abs(self._factor(p.name)[0])
                with np.errstate(divide="ignore"):
                    edges[:, k] = np.log(np.maximum(1.0 + edges[:, k] * share, 0.0)) * u / self.prior(p.name)[1]
        return edges

    def _tolerance(self, p: Parameter) -> float:
        """Tolerance of the quantity that a parameter is beyond, as a share of the parameter's prior."""
        return self.prior(p.alias)[1] / self.prior(p.name)[1] if p.alias is not None else 0.0

    # ---- a step
    def move(self, model: Model, normal: Normal) -> float:
        """Move the point to a model's fit.

        Returns
        -------
        log evidence that the step promises; infinite where it switches an effect on that was a secant
        """
        given, promised = self.step(model, normal)
        inside = {c.unit: c for c in model.choices}
        on: set[str] = set()
        moved = {n: given[n] for n in self.nuisances}
        switched: list[tuple[Unit, Parameter, float]] = []
        for unit in self.units:
            if unit.id not in inside:
                continue
            for p in self.active(unit)[inside[unit.id].variant % OTHER_FORM].parameters:
                d = given.get(p.name, 0.0)
                if p.secant is not None:
                    switched.append((unit, p, d))
                else:
                    moved[p.name] = d
            on.add(unit.id)
        # of another variant of a unit that acts the step has taken out what the point held
        out = {p.name: p.off for u in self.units for p in u.parameters if u.id not in inside or p.name not in moved}
        self.instead = self.point | self.after(moved, in_values) | out
        self.point |= self.after(moved) | out
        for unit, p, d in switched:
            self._switch_on(unit, p, d)
        self.on = on
        return np.inf if switched else promised

    def gained_beside(self, model: Model, normal: Normal) -> float:
        """Log evidence that a model's columns which are no parameters gain at the point (variable projection; Golub and
        Pereyra 1973, SIAM J. Numer. Anal. 10, 413)."""
        return -0.5 * sum(float(normal.g[normal.index[n]]) * d for n, d in self.beside(model, normal).items())

    def beside(self, model: Model, normal: Normal) -> dict[str, float]:
        """A model's columns that are no parameters, which it is linear in, at their best at the point as it is."""
        names = [n for n in model.deviations if not is_parameter(n) and n in normal.index]
        if not names:
            return {}
        k = np.array([normal.index[n] for n in names], int)
        A = normal.H[np.ix_(k, k)] + np.diag(1.0 / self.widths(names, model) ** 2)
        return dict(zip(names, (-Definite(A).solve(normal.g[k])).tolist(), strict=True))
