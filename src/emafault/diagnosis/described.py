"""Described forms as candidate causes: proposed by scans of what is left, then columns like every other unit's."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .evidence import SETTLED, Definite, Reduced
from .forms import FORMS, function
from .left import Found, Known, Left, beside_first, gain
from .linear import FEW
from .model import LISTED, SETTINGS, WORDS, Block, Parameter, Unit, Variant
from .search import Search
from .set_prior import ONE_MORE_FORM
from .sets import OTHER_FORM

PROPOSED = 12  # forms that a scan proposes at most
CHANNELED = 6  # of which, at most, are looked for in the channels of the measuring chain too
BINS = (30, 15, 8)  # of a picture: the most that show more than their errors
FINER = 2.0  # times what a coarse look finds, that a fine one may
STEPS = (-3.0, -1.0, -0.3, 0.0, 0.3, 1.0, 3.0)  # standard deviations of a scan, about the shape that it has found
PRIOR = float(np.log(ONE_MORE_FORM / len(WORDS)))  # log odds of a form of one kind
ALIKE = 0.9  # cosine from which a form is another one of a listed effect
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


Proposal = tuple[float, Described]  # with its approximate log odds


def scanned(
    machine,
    blocks: Sequence[Block],
    carried: Mapping[str, Mapping],
    free: Mapping[str, tuple[float, float]],
    mark: str,
    part: int = 0,
    parts: int = 1,
) -> list[Proposal]:
    """Forms that stand out of what blocks leave in an equation each, of one of several parts of the equations.

    Parameters
    ----------
    carried : by recording and equation, the weights of its rows
    free : what is free beside a form, by name of its column: mean and standard deviation of its deviation
    mark : of this scan, in the ids of what it proposes
    """
    of: dict[str, list[Block]] = {}
    for b in blocks:
        if b.equation not in SETTINGS and len(b.residual) >= FEW:
            of.setdefault(b.equation, []).append(b)
    places = sum(len(b[0].coordinates["drivers"]) for b in of.values())
    found: list[Proposal] = []
    for equation, own in list(of.items())[part::parts]:
        left = Left(equation, own, [carried[b.recording][equation] for b in own], free)
        for word, form in FORMS.items():
            coarse = [(*at, d) for d in range(left.drivers) if (at := form.coarse(left, d)) is not None]
            if not coarse:
                continue
            value, best, driver = -np.inf, list[Found](), 0
            for shape, roughly, d in sorted(coarse, key=lambda c: -c[1]):
                # no shape near it is worth proposing, or explains as much as another driver does once refined
                most_there = FINER * roughly
                if most_there + PRIOR < float(np.log(places)) or (best and most_there <= best[0].evidence):
                    break
                fine = [(f.evidence - float(np.log(f.among * places)) + PRIOR, f) for f in form.fine(left, d, shape)]
                most = max(v for v, _ in fine)
                if most > value:
                    # what differs by what is free beside it is as likely, and told apart by the prior of that alone
                    value, best, driver = most, [f for v, f in fine if v == most], d
            name, scale = f"~{word}_{equation}_{driver}_{mark}", left.scale(driver)
            for k, f in enumerate(best if value > 0.0 else []):
                unit = name + ALSO * k
                found.append((value, Described(unit, word, equation, driver, f.shape, scale, f.among * places)))
    return found


def proposed(machine, found: Sequence[Proposal]) -> list[Described]:
    """The most probable of what scans have found, each in the channels and coefficients that it may lie in as well."""
    every = [d for _, d in sorted(found, key=lambda x: (-x[0], x[1].id))]
    most = [d for d in every if not d.id.endswith(ALSO)]
    names = {d.id for d in most[:PROPOSED]}
    out = [d for d in every if d.id.removesuffix(ALSO) in names]
    elsewhere: list[Described] = []
    for form in (c for d in most[:CHANNELED] for c in _elsewhere(machine, d)):
        shown = next((k for k, other in enumerate(elsewhere) if form.same(other)), None)
        if shown is None:
            elsewhere.append(form)
        elif form.sharper(elsewhere[shown]):  # several equations may show it, one of them best
            elsewhere[shown] = form
    return [*out, *elsewhere]


def _elsewhere(machine, form: Described) -> list[Described]:
    """The same shape where it acts in several equations: a channel of the measuring chain, or a coefficient that they
    share."""
    module = FORMS[form.word]
    names = [c for c in machine.channels(form.equation, form.driver) if c.split("_")[0] in module.CHANNELS]
    if form.driver > 0 and not module.EACH:
        names += machine.coefficients(form.equation, form.driver)
    out = []
    for place in names:
        equation, scale = machine.place(place)
        name = f"{form.id}_{place}"
        out.append(
            replace(
                form,
                id=name,
                equation=equation,
                seen=form.equation,
                channel=place,
                scale=scale,
                among=form.among * len(names),
            )
        )
    return out


def refined(
    machine: WithForms,
    form: Described,
    blocks: Sequence[Block],
    carried: Mapping[str, Mapping],
    values: Mapping[str, float],
    free: Mapping[str, tuple[float, float]],
) -> Described:
    """A form with the shape that explains most of what is left with it out, near the one that it has.

    Parameters
    ----------
    blocks : those at the point that ``values`` has, the form's own coefficients among them
    carried : by recording and equation, the weights of its rows
    free : what is free beside it, see ``scanned``
    """
    module = FORMS[form.word]
    if form.channel and form.channel not in machine.coefficients(form.seen, form.driver):
        return form  # a channel's columns are differences of all equations, too dear to look around
    mine = {n for b in blocks for n in form.names(b.recording)}
    beside = {n: q for n, q in free.items() if n not in mine}
    acting: dict[str, list[Block]] = {}
    for b in blocks if form.channel else [b for b in blocks if b.equation == form.equation]:
        if machine.columns(form, b, values) is not None:
            acting.setdefault(b.equation, []).extend(without(machine, form, [b], values))
    if not acting:  # in these recordings
        return form
    lefts = [Left(e, own, [carried[b.recording][e] for b in own], beside) for e, own in acting.items()]

    def value(at: Described) -> float:
        def beside_constant(b: Block) -> np.ndarray:
            if not form.channel:
                return np.vstack([np.asarray(b.coordinates["drivers"][form.driver]), at.columns(b)])
            x = module.columns(machine.sampled(b.recording, form.channel), at.values)
            return machine.seen_in(form.channel, b.recording, np.vstack([np.ones(x.shape[1]), x]))[b.equation]

        if module.EACH:
            return sum(gain(*p) for left in lefts for p in left.each(at.columns, 0))
        g, G = zip(*(left.products(beside_constant, 0) for left in lefts), strict=True)
        return gain(*beside_first(np.sum(g, axis=0), np.sum(G, axis=0)))

    best, before = value(form), -np.inf
    while best - before >= SETTLED:
        before = best
        for k, (_, _, width, _) in enumerate(form.shape):
            if width > 0.0:
                form, best = _along(value, form, best, k)
    return form


def _along(value: Callable[[Described], float], form: Described, best: float, k: int) -> tuple[Described, float]:
    """A form, and its value, at the best of several steps of one parameter of its shape, or at the vertex of the
    parabola through that and its neighbours."""
    name, at, width, unit = form.shape[k]

    def moved(step: float) -> Described:
        return replace(form, shape=(*form.shape[:k], (name, at + step * width, width, unit), *form.shape[k + 1 :]))

    def stepped(step: float) -> tuple[float, Described]:
        return (best if step == 0.0 else value(moved(step))), moved(step)

    steps = [s for s in STEPS if s == 0.0 or moved(s).possible]
    found = [stepped(s) for s in steps]
    top = max(range(len(steps)), key=lambda i: found[i][0])
    if 0 < top < len(steps) - 1:
        around = slice(top - 1, top + 2)
        square, slope, _ = np.polyfit(steps[around], [v for v, _ in found[around]], 2)
        if square < 0.0:
            found.append(stepped(float(-0.5 * slope / square)))
    value_there, there = max(found, key=lambda x: x[0])
    return there, value_there


def without(machine: WithForms, form: Described, blocks: Sequence[Block], values: Mapping[str, float]) -> list[Block]:
    """Blocks with what a form's coefficients take out of them put back."""
    out = []
    for b in blocks:
        here = np.array([values.get(n, 0.0) for n in form.names(b.recording)])
        columns = machine.columns(form, b, values)
        out.append(b if columns is None else replace(b, residual=b.residual - here @ columns))
    return out


def curve(
    machine: WithForms, form: Described, blocks: Sequence[Block], carried: Mapping[str, Mapping], values: Mapping
) -> dict[str, list[float]]:
    """What the equation that shows a form leaves along the form, with it out of the model and in.

    Returns
    -------
    ``x`` middle of each of ``BINS``; ``before``, ``after`` generalised least-squares means over them, of the driver's
    coefficient; ``error``, their standard errors
    """
    module = FORMS[form.word]
    own = [b for b in blocks if b.equation == form.shown]
    along = {}
    for b in own:
        here = np.array([values.get(n, 0.0) for n in form.names(b.recording)])
        along[b.recording] = module.position(b.coordinates, form.values, here)
    both = [
        Left(form.shown, which, [carried[b.recording][b.equation] for b in own])
        for which in (without(machine, form, own, values), own)
    ]
    for bins in BINS:
        x, (before, after), error = _binned(both, along, bins, form.driver)
        if np.var(before) > 2.0 * np.mean(error**2):
            break
    return {"x": x.tolist(), "before": before.tolist(), "after": after.tolist(), "error": error.tolist()}


def _binned(
    lefts: Sequence[Left], along: Mapping[str, np.ndarray], bins: int, driver: int
) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Middles of bins along a coordinate, what each of several residuals has there and the standard error of that."""
    low, high = min(x.min() for x in along.values()), max(x.max() for x in along.values())
    edges = np.linspace(low, high, bins + 1)

    def cells(b: Block) -> np.ndarray:
        at = np.clip(np.searchsorted(edges, along[b.recording], "right") - 1, 0, bins - 1)
        return at == np.arange(bins)[:, None]

    means = []
    for left in lefts:
        g, G = left.products(cells, driver)
        used = np.diag(G) > 1e-9 * np.diag(G).max()
        inverse = np.linalg.pinv(G[np.ix_(used, used)], hermitian=True)
        means.append(inverse @ g[used])
    return 0.5 * (edges[1:] + edges[:-1])[used], means, np.sqrt(np.maximum(np.diag(inverse), 0.0))


def another_form_of(
    reduced: Callable[[tuple[str, ...]], Reduced], search: Search, unit: str, deviations: Mapping[str, float]
) -> str | None:
    """Listed effect whose signal is nearly that of a form or a remainder, the nuisances taken out of both; None where
    there is none.

    The tolerance of a quantity that the effect is another value of is not: it would take the effect out with it.

    Parameters
    ----------
    reduced : the linear model with the nuisances marginalised but for those named
    deviations : coefficients of the set that has it

    Notes
    -----
    The cosine is that between what it adds and the nearest that the effect can.
    """
    best, nearest = ALIKE**2, None
    every = dict.fromkeys(n for (u, _), c in search.candidates.items() if u == unit for n in c.names)
    own = [n for n in every if n in deviations]
    c = np.array([deviations[n] for n in own])
    for (other, variant), candidate in search.candidates.items():
        if search.units[other].kind not in LISTED or variant >= OTHER_FORM:
            continue
        r = reduced(tuple(p.alias for p in search.units[other].parameters if p.alias))
        k, j = (np.array([r.index[n] for n in names], int) for names in (own, candidate.names))
        power = float(c @ r.M[np.ix_(k, k)] @ c)
        if power <= 0.0:
            continue
        scale = 1.0 / np.sqrt(np.maximum(np.diag(r.M)[j], 1e-300))
        score = scale * (r.M[np.ix_(j, k)] @ c)
        own_power = r.M[np.ix_(j, j)] * np.outer(scale, scale) + 1e-9 * np.eye(len(j))
        share = float(score @ Definite(own_power).solve(score)) / power
        if share > best:
            best, nearest = share, other
    return nearest
