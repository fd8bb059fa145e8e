"""The fit of a bench: linearise, search, relinearise at what leads, until it stands still."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .evidence import Definite, Normal, Reduced, marginalise
from .forked import Workers
from .linear import OWN_FORM, White, assemble, full_model, white_rows
from .linearisation import Carried, Linearisation, Task
from .model import LISTED, Parameter, Unit, Variant
from .search import OTHER_FORM, REMAINDER_SIZES, WIDTHS, Candidate, Choice, Model, Search

ROUNDS = 3
FIRST = 2  # rounds of the search before remainders and own forms
LEAVES = 1  # times that a member of the leading set may fall at a closer look
SETTLING = 3  # steps of a set to its own optimum
CARRYING = 6  # units that carry their own form
OWN_SHARES = (1.0, 0.2)  # of the largest own form: as far from the library's as a form is, or near it
STILL = 0.3  # prior standard deviations by which the point may still move
REACH = (1.0, 3.0)  # prior standard deviations from the prior's mean that the point keeps to, at first and later
FAR = 1e3  # log evidence that a step promises, beyond which its own bias does not matter
SETTLED = 0.5  # log evidence that one more step of a set may still promise


NOTHING = Model((), 0.0, 0.0, {}, {})  # the unit alone


def is_parameter(column: str) -> bool:
    """Whether a column is a parameter's, and not a function of a remainder or of an effect's own form."""
    return not column.startswith(("remainder.", "own."))


@dataclass
class Fit:
    """Where a bench's search ended."""

    values: dict[str, float]  # the point of linearisation
    whites: list[White]
    carried: dict[str, Carried]  # by recording
    models: list[Model]
    reduced: Reduced
    normal: Normal
    search: Search


@dataclass
class Inserted:
    """A fitted set as a model of other recordings: all values, and what stands beside them.

    ``beside``: coefficients of remainders and own forms by column; ``own``: sizes of the units that carry their own
    form.
    """

    values: dict[str, float]
    beside: dict[str, float]
    own: dict[str, dict[str, float]]


class Bench:
    """Recordings of one machine under one linearised model.

    Parameters
    ----------
    machine : gives ``parameters``, ``units`` and ``blocks(values, recordings)``
    recordings : names of those that are fitted
    processes : in which recordings are linearised side by side
    """

    searching: type[Search] = Search
    reaches = REACH
    settled = SETTLED

    def __init__(self, machine, recordings: Sequence[str], processes: int = 1):
        self.machine, self.recordings, self.processes = machine, list(recordings), processes
        self.parameters: dict[str, Parameter] = dict(machine.parameters)
        self.units: list[Unit] = list(machine.units)
        self.point = {n: p.off for n, p in self.parameters.items()}
        self.on: set[str] = set()
        self.reach = self.reaches[1]
        self.carried: dict[str, Carried] = {}
        of_unit = {p.name for u in self.units for p in u.parameters}
        mine = set(self.recordings)
        self.nuisances = [
            n
            for n, p in self.parameters.items()
            if n not in of_unit and not p.fixed and p.sd > 0.0 and ("@" not in n or n.split("@", 1)[1] in mine)
        ]
        self._beyond: dict[str, list[str]] = {}
        for n, p in self.parameters.items():
            if p.alias is not None:
                self._beyond.setdefault(p.alias, []).append(n)
        self._inserted: dict[tuple, Inserted] = {}
        self.workers: Workers | None = None
        self.remainders: dict[str, Unit] = {}
        self.sizes: dict[str, dict[str, float]] = {}  # of the units that carry their own form
        self.closer: dict[str, float] = {}  # what a closer look took off the log evidence that a secant gave a unit

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

    def linearise(self, model: Model | None = None, renew: bool = False, corrected: bool = True) -> list[White]:
        """Normal matrices of all blocks at the present point, with every column, or with those that a model has.

        ``renew`` takes the weights from what a full model leaves there.
        ``corrected`` takes out what the noise in the regressors adds.
        """
        columns, aliases = self._columns_of(model)
        wanted = tuple(dict.fromkeys([*self.nuisances, *[aliases.get(n, n) for n in columns]]))
        left = None
        if model is not None:
            left = frozenset(u.split(":", 1)[1] for u in model.units if u.startswith("remainder:"))
        task = Task(self.values(), wanted, left, self._amounts(model), corrected=corrected)
        if not renew:
            return self._each(task, self.recordings)
        whites = self._each(replace(task, again=True, corrected=False), self.recordings)
        full = full_model(whites, self._full_prior(columns, aliases))
        return self._each(replace(task, full=full), self.recordings)

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
        if self.workers is None:
            several = min(self.processes, len(self.recordings))
            for name in self.recordings if several > 1 else ():
                self.machine.prepare(name)
            self.workers = Workers(self, Linearisation(self.machine), several)
        found = self.workers.map("compress", [(task, n, self.carried.get(n, {})) for n in names])
        self.carried |= {n: carried for n, (_, carried) in zip(names, found, strict=True)}
        return [w for whites, _ in found for w in whites]

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

    def _amounts(self, model: Model | None) -> dict[str, dict[str, float]]:
        """Sizes from off, by column, of the units that carry their own form."""
        out = {}
        for unit in self.units:
            if unit.id not in self.sizes or (model is not None and unit.id not in model.units):
                continue
            sizes = self.sizes[unit.id]
            if unit.id in self.on:  # of what the point holds: an effect of no size has no form
                here = self.active(unit)[0].parameters if unit.on is not None else unit.parameters
                sizes = self.sizes[unit.id] = {p.name: -self.prior(p.name)[2] for p in here}
            out[unit.id] = {self.parameters[n].alias or n: d for n, d in sizes.items()}
        return out

    def _carry_own_forms(self, search: Search) -> bool:
        """Units of the leading set, then those that explain most alone, may take another form than the library's, in
        proportion to their size; whether any of the leading set does that did not before."""
        before = self.sizes
        leading = search.ranked()[0]
        if before and {c.unit for c in leading.choices if self._kind(c.unit) in LISTED} <= set(before):
            return False
        nothing = search.fit(())
        alone = [search.fit((m,)) for m in search.candidates if self._kind(m[0]) in LISTED and m[1] < OTHER_FORM]
        good = [m for m in alone if m.log_posterior > nothing.log_posterior]
        self.sizes = {}
        for model in [leading, *sorted(good, key=lambda m: -m.log_posterior)]:
            for choice in model.choices:
                if len(self.sizes) < CARRYING and self._kind(choice.unit) in LISTED and choice.unit not in self.sizes:
                    names = self.names_of(choice)
                    self.sizes[choice.unit] = {n: model.deviations[n] - self.prior(n)[2] for n in names}
        return bool(self.sizes)

    def names_of(self, choice: Choice) -> list[str]:
        """Columns of a unit's variant at the present point."""
        if choice.unit.startswith("remainder:"):
            return []
        unit = next(u for u in self.units if u.id == choice.unit)
        return [p.name for p in self.active(unit)[choice.variant % OTHER_FORM].parameters]

    def normal(self, whites: Sequence[White], model: Model | None = None) -> Normal:
        """Normal matrix of all columns, or of those that a model has, remainders among them."""
        columns, aliases = self._columns_of(model)
        left = list(dict.fromkeys(n for w in whites for n in w.names if not is_parameter(n)))
        return assemble(whites, [*self.nuisances, *columns, *left], aliases)

    def prior(self, name: str) -> tuple[float, float, float]:
        """Deviation of the prior's mean from the point, its standard deviation, and the deviation that is off."""
        if not is_parameter(name):
            return 0.0, OWN_FORM if name.startswith("own.") else 1.0, 0.0
        p = self.parameters[name]
        at = self.point.get(name, p.off)
        if p.vanishes is None:
            return p.mean - at, p.sd, p.off - at
        u, factor = self._factor(name)
        if p.alias is not None:  # beyond its tolerance: a factor on its quantity's own
            own = u / factor
            return -u * np.log(factor), p.sd * u / own, -u * np.log(factor)
        mean, off = p.mean - p.vanishes, p.off - p.vanishes
        return u * np.log(mean / factor), p.sd * abs(u / mean), u * np.log(off / factor)

    def _factor(self, name: str) -> tuple[float, float]:
        """What a parameter that multiplies makes with its alias, the unit of its deviations, and its own factor."""
        p = self.parameters[name]
        assert p.vanishes is not None
        own = p.alias or name
        base = self.point.get(own, self.parameters[own].off) - p.vanishes
        beyond = sum(self.point.get(n, 0.0) for n in self._beyond.get(own, ()))
        if p.alias is None:
            return base + beyond, base
        return base + beyond, (base + beyond) / base

    def after(self, given: Mapping[str, float]) -> dict[str, float]:
        """Values of parameters after deviations from the point."""
        out: dict[str, float] = {}
        for n, d in given.items():
            if not is_parameter(n):
                continue
            p = self.parameters[n]
            if p.vanishes is None:
                out[n] = self.point.get(n, p.off) + d
            elif p.alias is None:
                u, factor = self._factor(n)
                out[n] = p.vanishes + factor * float(np.exp(np.clip(d / u, -1.0, 1.0)))
            else:
                u, factor = self._factor(n)
                own = out.get(p.alias, p.vanishes + u / factor)
                out[n] = (own - p.vanishes) * (factor * float(np.exp(np.clip(d / u, -1.0, 1.0))) - 1.0)
        return out

    def reduce(self, normal: Normal) -> Reduced:
        """The nuisances marginalised."""
        prior = {n: self.prior(n) for n in normal.names}
        mean = np.array([prior[n][0] for n in self.nuisances])
        sd = np.array([prior[n][1] for n in self.nuisances])
        fixed = np.array([prior[n][2] for n in normal.names])
        return marginalise(normal, self.nuisances, mean, sd, fixed)

    def nuisance_deviations(self, normal: Normal, given: dict[str, float]) -> dict[str, float]:
        """Deviations of the nuisances where other columns take those given, the rest off."""
        index = normal.index
        n = np.array([index[x] for x in self.nuisances])
        rest = [x for x in normal.names if x not in set(self.nuisances)]
        d = np.array([given.get(x, self.prior(x)[2]) for x in rest])
        r = np.array([index[x] for x in rest], int)
        mean = np.array([self.prior(x)[0] for x in self.nuisances])
        sd = np.array([self.prior(x)[1] for x in self.nuisances])
        A = normal.H[np.ix_(n, n)] + np.diag(1.0 / sd**2)
        right = mean / sd**2 - normal.g[n] - normal.H[np.ix_(n, r)] @ d
        found = Definite(A).solve(right)
        return dict(zip(self.nuisances, found.tolist(), strict=True))

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
                    (1.0,) if switch else tuple(w for w in WIDTHS if w >= min(variant.least, 1.0)), names,
                    np.array(variant.hole), np.array([self._tolerance(p) for p in variant.parameters]),
                )  # fmt: skip
                out[unit.id, v] = plain
                for k, (share, inside) in enumerate(self._own_kinds(reduced, own), start=1):
                    own_sd = np.full(len(inside), share * OWN_FORM)
                    out[unit.id, v + k * OTHER_FORM] = replace(plain, extra=inside, extra_sd=own_sd)
        left: dict[str, tuple[list[int], list[int]]] = {}
        for k, n in enumerate(reduced.names):
            if n.startswith("remainder."):
                left.setdefault(n.split(".")[1], ([], []))["@" in n].append(k)
        for equation, kinds in left.items():
            # the same in all recordings, or another in each
            each = [np.array(k) for k in kinds if k]
            if kinds[0]:
                of = self.machine.families(equation) if hasattr(self.machine, "families") else ()
                where = {k: reduced.names[k].split(".")[2:] for k in kinds[0]}
                for family in of:
                    each.append(np.array([k for k, (d, f) in where.items() if (int(d), int(f)) in family]))
            unit = Unit(f"remainder:{equation}", "remainder", (equation,), [Variant([])] * len(each))
            self.remainders.setdefault(unit.id, unit)
            for v, index in enumerate(each):
                out[unit.id, v] = Candidate(
                    index, np.zeros(len(index)), np.ones(len(index)), np.zeros(len(index), int), REMAINDER_SIZES,
                    [reduced.names[k] for k in index],
                )  # fmt: skip
        return [*self.units, *self.remainders.values()], out

    def _own_kinds(self, reduced: Reduced, own: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """Share of the largest own form and columns of each kind of own form: along every coordinate, or along one."""
        if not len(own):
            return []
        every = [own]
        where = {k: reduced.names[k].split(".")[2:] for k in own.tolist()}
        if hasattr(self.machine, "families"):
            equations = {e for e, _ in where.values()}
            of = {e: self.machine.families(e) for e in equations}
            every.append(np.array([k for k, (_, f) in where.items() if f == "0"], int))  # by equation
            for n in range(len(next(iter(of.values())))):
                every.append(np.array([k for k, (e, f) in where.items() if (0, int(f)) in of[e][n]], int))
        return [(share, inside) for inside in every for share in OWN_SHARES]

    def _tolerance(self, p: Parameter) -> float:
        """Tolerance of the quantity that a parameter is beyond, as a share of the parameter's prior."""
        return self.parameters[p.alias].sd / p.sd if p.alias is not None else 0.0

    # ---- the whole
    def move(self, model: Model, normal: Normal) -> tuple[float, float]:
        """Move the point to a model's fit.

        Returns
        -------
        largest step in prior standard deviations, and the log evidence that the step promises (Newton decrement;
        Boyd and Vandenberghe 2004, Convex Optimization, section 9.5.1)
        """
        given = {n: d for n, d in model.deviations.items()}
        nuisance = self.nuisance_deviations(normal, given)
        largest = max((abs(d) / self.prior(n)[1] for n, d in nuisance.items()), default=0.0)
        inside = {c.unit: c for c in model.choices}
        on: set[str] = set()
        moved = dict(nuisance)
        switched: list[tuple[Unit, Parameter, float]] = []
        for unit in self.units:
            if unit.id not in inside:
                continue
            for p in self.active(unit)[inside[unit.id].variant % OTHER_FORM].parameters:
                d = given.get(p.name, 0.0)
                if p.secant is not None:
                    switched.append((unit, p, d))
                    largest = 1.0
                else:
                    largest = max(largest, abs(d) / p.sd)
                    if unit.on is not None and unit.id in self.on and len(unit.variants) > 1:
                        d = float(np.clip(d, -p.sd, p.sd))  # what is not linear is approached in steps
                    moved[p.name] = d
            on.add(unit.id)
        moved = {n: self._within_reach(n, d) for n, d in moved.items()}
        decrement = np.inf if switched else self._decrement(moved, normal)
        found = self.after(moved)
        for unit in self.units:
            if unit.id not in inside:
                found |= {p.name: p.off for p in unit.parameters}
        self.point |= found
        for unit, p, d in switched:
            self._switch_on(unit, p, d)
        self.on = on
        return largest, decrement

    def _within_reach(self, name: str, deviation: float) -> float:
        """A deviation no further than the prior has any mass: a model that lacks the cause asks for more."""
        mean, sd, _ = self.prior(name)
        return float(np.clip(deviation, mean - self.reach * sd, mean + self.reach * sd))

    def _decrement(self, moved: Mapping[str, float], normal: Normal) -> float:
        names = [n for n in moved if n in normal.index]
        k = np.array([normal.index[n] for n in names], int)
        d = np.array([moved[n] for n in names])
        sd = np.array([self.prior(n)[1] for n in names])
        return float(0.5 * (d @ normal.H[np.ix_(k, k)] @ d + np.sum((d / sd) ** 2)))

    def _switch_on(self, unit: Unit, p: Parameter, amount: float) -> None:
        """An effect found along a secant gets parameters of its own."""
        assert unit.on is not None and p.secant is not None
        amount = float(np.clip(amount, 0.2, 5.0))
        first = True
        for own in unit.on.parameters:
            at = p.secant.get(own.name, own.mean)
            self.point[own.name] = own.off + (at - own.off) * amount if first else at
            first = False

    def fit(self, begun: "tuple[Bench, Fit] | None" = None) -> Fit:
        """Search and relinearise until the leading set stands still.

        ``begun``: a bench of some of these recordings and its fit, to go on from.
        """
        if begun is None:
            # the unit first: its nuisances move the point before anything is compared, but not to where only a cause
            # that is missing would have them
            self.reach = self.reaches[0]
            self.settle(NOTHING)
            whites, normal = self._renewed()
            self.reach = self.reaches[1]
            # what no one has described comes last: it would take up what only a better point explains
            whites, normal, search = self._until_still(whites, normal, FIRST, False)
            if self._carry_own_forms(search):
                whites, normal = self._renewed()
        else:
            bench, fit = begun
            self.point |= {n: v for n, v in fit.values.items() if n in self.point}
            self.on, self.sizes, self.closer = set(bench.on), dict(bench.sizes), dict(bench.closer)
            self.carried |= fit.carried
            # until they are fitted, what the others' fit leaves of further recordings is their noise
            as_left = Task(self.values(), (), frozenset(), full={}, corrected=False)
            self._each(as_left, [n for n in self.recordings if n not in fit.carried])
            self.settle(fit.models[0])
            whites, normal = self._renewed()
        whites, normal, search = self._until_still(whites, normal, ROUNDS)
        for _ in range(LEAVES):
            if not self._leave_out(search, normal):
                break
            whites, normal = self._renewed()
            whites, normal, search = self._until_still(whites, normal, ROUNDS)
        return Fit(dict(self.point), whites, self.carried, search.ranked(), search.reduced, normal, search)

    def _renewed(self) -> tuple[list[White], Normal]:
        whites = self.linearise(renew=True)
        return whites, self.normal(whites)

    def _until_still(
        self, whites: list[White], normal: Normal, rounds: int, remainders: bool = True
    ) -> tuple[list[White], Normal, Search]:
        search = self._search(normal, remainders)
        renewed: tuple[str, ...] = ()
        for _ in range(rounds):
            best = search.ranked()[0]
            more = remainders and self._carry_own_forms(search)
            if self._step(best, normal) < STILL and not more:
                break
            self.settle(best, normal)
            # weights are those of the first look at a set: no hypothesis gains by what it leaves
            whites = self.linearise(renew=more or best.units != renewed)
            renewed = best.units
            normal = self.normal(whites)
            search = self._search(normal, remainders)
        return whites, normal, search

    def _kind(self, unit: str) -> str:
        return next((u.kind for u in self.units if u.id == unit), "remainder")

    def _search(self, normal: Normal, remainders: bool = True) -> Search:
        reduced = self.reduce(normal)
        units, candidates = self.candidates(reduced)
        if not remainders:
            candidates = {m: c for m, c in candidates.items() if not m[0].startswith("remainder:")}
        search = self.searching(reduced, units, candidates, {u: c for u, c in self.closer.items() if u not in self.on})
        search.run()
        return search

    # ---- finalists, each at its own optimum
    def _step(self, model: Model, normal: Normal) -> float:
        """Largest step that a model would move the point by, which stays."""
        kept = dict(self.point), set(self.on)
        step = self.move(model, normal)[0]
        self.point, self.on = kept
        return step

    def settle(self, model: Model, normal: Normal | None = None, steps: int = SETTLING) -> Model:
        """A set at its own optimum, by Gauss-Newton from the present point, which moves there.

        ``normal`` of a model fitted there saves the first step.
        """
        ahead = np.inf  # log evidence that the last step promised
        if normal is not None:
            on = set(self.on)
            ahead = self.move(model, normal)[1]
            if ahead < self.settled:
                return model
            if any(u.on is not None and len(u.variants) > 1 and u.id in self.on - on for u in self.units):
                # a secant points the way only: its effect finds its place before anything undescribed takes it
                kept = tuple(c for c in model.choices if self._kind(c.unit) not in ("form", "remainder"))
                return self.settle(Model(kept, 0.0, 0.0, {}, {}))
        for _ in range(steps):
            if ahead < FAR:
                break
            # on its way a set may be led by a little bias, where it ends it must not
            found, at_point = self._fitted(model, corrected=False)
            ahead = self.move(found, at_point)[1]
        for _ in range(steps):
            found, at_point = self._fitted(model)
            if self.move(found, at_point)[1] < self.settled:
                break
        return found

    def inserted(self, model: Model, normal: Normal) -> Inserted:
        """A set at its own optimum, where the point is left as it was; ``normal`` of the present point."""
        key = model.choices, tuple(sorted(self.point.items()))
        if key in self._inserted:
            return self._inserted[key]
        kept = dict(self.point), set(self.on), dict(self.sizes)
        found = self.settle(model, normal)
        values = self.values()
        own = {
            u: {self.parameters[n].alias or n: d for n, d in sizes.items()}
            for u, sizes in self.sizes.items()
            if u in found.units
        }
        self.point, self.on, self.sizes = kept
        beside = {n: d for n, d in found.deviations.items() if not is_parameter(n)}
        self._inserted[key] = Inserted(values, beside, own)
        return self._inserted[key]

    def _fitted(self, model: Model, corrected: bool = True) -> tuple[Model, Normal]:
        """A set fitted by the linear model of the present point, and that model; its members' widths stay."""
        shaped = {u.id for u in self.units if u.on is not None and u.id in self.on}
        choices = tuple(
            replace(c, variant=c.variant - c.variant % OTHER_FORM) if c.unit in shaped else c for c in model.choices
        )
        this = replace(model, choices=choices)
        at_point = self.normal(self.linearise(this, corrected=corrected), this)
        reduced = self.reduce(at_point)
        search = self.searching(reduced, *self.candidates(reduced))
        width = {
            (c.unit, c.variant if (c.unit, c.variant) in search.candidates else c.variant % OTHER_FORM): c.width
            for c in choices
        }
        fixed = {m: w for m, w in width.items() if w in search.candidates[m].widths}
        return search.fit(tuple(width), fixed), at_point

    def _leave_out(self, search: Search, normal: Normal) -> bool:
        """Compare the leading set with those that lack one member, each at its own optimum; whether one is better.

        What the linear model says of them from a point far from theirs is replaced by what it says at their own.
        """
        best = search.ranked()[0]
        members = [u for u in best.units if not u.startswith("remainder:")]
        if not members:
            return False
        begun = dict(self.point), set(self.on)
        leading = self.settle(best, normal)
        top = leading.log_posterior
        better = (dict(self.point), set(self.on)), False
        for unit in members:
            self.point, self.on = dict(begun[0]), set(begun[1])
            less = search.fit(tuple((c.unit, c.variant) for c in best.choices if c.unit != unit))
            self.move(less, normal)  # where the linear model has the set's optimum
            own = self.settle(Model(less.choices, 0.0, 0.0, {}, {}))
            error = best.log_posterior - less.log_posterior - (leading.log_posterior - own.log_posterior)
            if self._by_secant(unit):
                self.closer[unit] = -error
            less.log_posterior += error
            if own.log_posterior > top:
                top, better = own.log_posterior, ((dict(self.point), set(self.on)), True)
        self.point, self.on = better[0] if better[1] else begun
        return better[1]

    def _by_secant(self, unit: str) -> bool:
        return any(p.secant is not None for u in self.units if u.id == unit for p in u.parameters)
