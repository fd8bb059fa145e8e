"""What is shown of a described form: its curve, and the listed effect that it is nearly."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from .described import Described, WithForms, without
from .evidence import Definite, Reduced
from .forms import FORMS
from .left import Left
from .model import LISTED, Block
from .search import Search
from .sets import OTHER_FORM

BINS = (30, 15, 8)  # of a picture: the most that show more than their errors
ALIKE = 0.9  # cosine from which a form is another one of a listed effect


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
