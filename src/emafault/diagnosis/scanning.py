"""Scans of what is left for forms, and the shapes that these have beside all else."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from .described import ALSO, Described, WithForms, without
from .evidence import SETTLED
from .forms import FORMS
from .left import Found, Left, beside_first, gain
from .linear import FEW
from .model import SETTINGS, WORDS, Block
from .set_prior import ONE_MORE_FORM

PROPOSED = 12  # forms that a scan proposes at most
CHANNELED = 6  # of which, at most, are looked for in the channels of the measuring chain too
FINER = 2.0  # times what a coarse look finds, that a fine one may
STEPS = (-3.0, -1.0, -0.3, 0.0, 0.3, 1.0, 3.0)  # standard deviations of a scan, about the shape that it has found
PRIOR = float(np.log(ONE_MORE_FORM / len(WORDS)))  # log odds of a form of one kind

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
