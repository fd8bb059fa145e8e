"""Whether a unit has one size in all recordings: what a fault of the machine has, and what merely takes up something
else that comes and goes has not.

A set with the unit is compared with the same set in which the unit's parameters are random effects of the recordings:
drawn anew for each, with zero mean instead of a common one (Higgins, Thompson and Spiegelhalter 2009, Journal of the
Royal Statistical Society A 172, 137).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.special import logsumexp

from .evidence import Reduced, log_evidence
from .fit import Bench, Fit
from .linear import White, assemble, function_of
from .model import WORDS, meet
from .set_prior import ONE_MORE_FORM, OTHER_FORM_PRIOR, SIZE_PRIOR
from .sets import OTHER_FORM, Model

SCATTER = 0.1  # of a unit's own size, by which it may differ from recording to recording all the same
#: of what changes, over an effect's range; beyond it too, for the range is that of the effect and not of what changes
SIZES = (30.0, 10.0, 3.0, 1.0, 0.3, 0.1, 0.03)
SHARES = (10.0, 3.0, 1.0, 0.3)  # of a unit's size, of what goes along its columns without being of its form
#: log odds before the data that what is seen is no listed effect, but a coefficient that changes
PRIOR = float(np.log(ONE_MORE_FORM / len(WORDS)) - np.log(SIZE_PRIOR[1] / SIZE_PRIOR[0]))


def log_odds_of_change(bench: Bench, fit: Fit, model: Model, unit: str) -> float:
    """Log posterior odds that a unit of a set has another size in each recording, against one in all.

    The prior's sides and the number of its widths, which the search counts, are left out of both.

    Parameters
    ----------
    bench : at the point of the fit
    model : a set that holds the unit
    """
    choice = next(c for c in model.choices if c.unit == unit)
    mine = bench.names_of(replace(choice, variant=choice.variant % OTHER_FORM))
    aliases = bench.columns()[1]
    source = {n: aliases.get(n, n) for n in mine}
    own = {n: [_of(unit, n, r) for r in bench.recordings] for n in mine}
    prior = prior_of(fit, model)
    rest = [n for n in prior if n not in mine and not n.startswith(f"own.{unit}.")]
    form = [n for n in prior if n.startswith(f"own.{unit}.")]
    names = [*bench.nuisances, *rest, *mine, *form, *(o for each in own.values() for o in each)]
    whites = [_split(w, unit, source) for w in fit.whites]
    reduced = bench.reduce(assemble(whites, names, {n: q for n, q in aliases.items() if n in names}))

    evidence = partial(_evidence, reduced)
    beside = {n: prior[n] for n in rest}
    sizes = {n: abs(model.deviations.get(n, 0.0) - bench.prior(n)[2]) for n in mine}
    one = {**beside, **{n: prior[n] for n in (*mine, *form)}}
    scatter = {n: {o: (0.0, max(SCATTER * sizes[n], 1e-12)) for o in own[n]} for n in mine}
    candidate = fit.search.candidates[unit, choice.variant % OTHER_FORM]
    widest = dict(zip(candidate.names, candidate.sd, strict=True))
    free = [{n: {o: (0.0, w * widest[n]) for o in own[n]} for n in mine} for w in SIZES]
    changing = [evidence(beside | _all(each)) for each in free]
    constant = [evidence(one), evidence(one | _all(scatter))]
    if len(mine) > 1:  # what it is mostly seen by is the same; how it looks there may be another matter
        main = max(mine, key=lambda n: sizes[n] / model.spread.get(n, np.inf))
        constant += [evidence(one | _all({**each, main: scatter[main]})) for each in free]
    return float(log_mean(changing) - log_mean(constant) + PRIOR)


def log_odds_of_another_cause(fit: Fit, model: Model, unit: str, lacking: Collection[str] = ()) -> float:
    """Log posterior odds of a discrepancy as large as a unit of a set itself, or larger, against the unit in the
    library's form or one near it: what a unit takes up of another cause has such a discrepancy.

    It is a combination of functions of speed, current, time and angle, which the unit's columns are multiplied by; what
    its form may have by parameters of its own is the unit's at any size. The unit's own prior, and that of how much of
    it each equation has, are the same on both sides.

    Minus infinity for a unit that carries no form of its own, or none along anything.

    Parameters
    ----------
    lacking : equations in which something else is left too: a discrepancy there says nothing of a unit that acts in
        others as well
    """
    choice = next(c for c in model.choices if c.unit == unit)
    forms = [
        fit.search.candidates[unit, v] for u, v in fit.search.candidates
        if u == unit and v >= OTHER_FORM and v % OTHER_FORM == choice.variant % OTHER_FORM
    ]  # fmt: skip
    prior = prior_of(fit, model)
    names: Sequence[str] = fit.search.reduced.names
    evidence = partial(_evidence, fit.search.reduced)
    itself = {n: q for n, q in prior.items() if not n.startswith(f"own.{unit}.")}
    own = [{names[k]: (0.0, float(s)) for k, s in zip(f.extra, f.extra_sd, strict=True)} for f in forms]
    elsewhere = [{n: sd for n, sd in form.items() if not _in_any(n, lacking)} for form in own]
    if any(function_of(n) for form in elsewhere for n in form):
        own = elsewhere
    near = [evidence(itself | form) for form in own]
    widest = {tuple(form): form for form in sorted(own, key=lambda form: max(form.values()))}
    along = [(form, [n for n in form if function_of(n)]) for form in widest.values()]
    far = [evidence(itself | form | {n: (0.0, s) for n in free}) for form, free in along if free for s in SHARES]
    if not far:
        return -np.inf
    of = [evidence(itself) + np.log(1.0 - OTHER_FORM_PRIOR), log_mean(near) + np.log(OTHER_FORM_PRIOR)]
    return float(log_mean(far) - logsumexp(of) + PRIOR)


def _in_any(own: str, equations: Collection[str]) -> bool:
    """Whether a column of an own form is a function's in one of some equations."""
    return bool(function_of(own)) and meet(own.split(".")[2:3], equations)


def _evidence(reduced: Reduced, free: Mapping[str, tuple[float, float]]) -> float:
    """Log evidence with these columns free: mean and standard deviation of each."""
    index = np.array([reduced.index[n] for n in free], int)
    mean, sd = np.array([*free.values()]).reshape(-1, 2).T
    return log_evidence(reduced, index, mean, sd)[0]


def _all(by_column: Mapping[str, Mapping[str, tuple[float, float]]]) -> dict[str, tuple[float, float]]:
    return {o: q for each in by_column.values() for o, q in each.items()}


def log_mean(logs: Sequence[float]) -> float:
    """Logarithm of the mean."""
    return float(logsumexp(logs) - np.log(len(logs)))


def _of(unit: str, name: str, recording: str) -> str:
    return f"own.{unit}.{name}@{recording}"


def _split(white: White, unit: str, source: dict[str, str]) -> White:
    """A block with the columns of ``source`` once more, under names of its recording's own."""
    index = {n: k for k, n in enumerate(white.names)}
    more = [n for n, q in source.items() if q in index]
    size = len(white.names)
    k = np.array([*range(size), *(index[source[n]] for n in more), size], int)
    noise = None if white.noise is None else white.noise[np.ix_(k[:-1], k[:-1])]
    names = [*white.names, *(_of(unit, n, white.recording) for n in more)]
    return replace(white, names=names, gram=white.gram[np.ix_(k, k)], noise=noise)


def prior_of(fit: Fit, model: Model) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of a set's columns, by name."""
    names: Sequence[str] = fit.search.reduced.names
    out: dict[str, tuple[float, float]] = {}
    for c in model.choices:
        candidate = fit.search.candidates[c.unit, c.variant]
        out |= {
            n: (float(m), float(s * c.width))
            for n, m, s in zip(candidate.names, candidate.mean, candidate.sd, strict=True)
        }
        out |= {names[k]: (0.0, float(s)) for k, s in zip(candidate.extra, candidate.extra_sd, strict=True)}
    return out
