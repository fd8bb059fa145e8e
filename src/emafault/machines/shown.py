"""What the page of a measured machine shows beside its verdict: charts of its equations and every fitted number."""

import numpy as np

from ..reporting.numbers import Number, Numbers, as_told
from ..reporting.panels import Curves, Panel
from ..reporting.regions import coordinate
from .diagnose import Diagnosed
from .statement import Rows
from .verdict import covariance_of


def panels(found: Diagnosed) -> list[Panel]:
    """One panel an equation: the recalibrated base model before, the leading set after."""
    points = [
        {n: v for n, v in p.items() if "@" not in n} for p in (found.whole.base(), found.whole.settled.values)
    ]  # fmt: skip
    curves: dict[str, list[Curves]] = {}
    for rows in found.machine.rows:
        left = rows.observed - found.whole.recorded.predict(rows, points)
        curves.setdefault(rows.equation, []).append(_curves(found, rows, left))
    return [Panel(e, f"{e.replace('_', ' ')}, measured side", of) for e, of in curves.items()]


def _curves(found: Diagnosed, rows: Rows, left: np.ndarray) -> Curves:
    deviation = np.sqrt(np.diag(rows.covariance))
    words = found.machine.words
    along = {coordinate(rows.along, words): 0.5 * (rows.low + rows.high)}
    along |= {coordinate(n, words): np.asarray(x, float) for n, x in rows.beside.items()}
    white = np.linalg.solve(np.linalg.cholesky(rows.covariance), left.T)
    before, after = (float(s) for s in np.sum(white**2, axis=0))
    aside = rows.recording in found.machine.confirm
    observed = np.asarray(rows.observed, float)
    return Curves(
        rows.recording, along, left[0] / deviation, left[1] / deviation, deviation, observed, (before, after), aside
    )


def numbers(found: Diagnosed) -> Numbers:
    """Parameters of the base model and of the leading set; errors that rows share are those of a recording."""
    fitted = found.whole
    bench, after = fitted.bench, fitted.settled.values
    names, covariance = covariance_of(fitted)
    kept = [k for k, n in enumerate(names) if bench.parameters[n].secant is None and not n.startswith("error.")]
    own = set(fitted.leading.deviations)
    out = []
    for k in kept:
        n = names[k]
        p, sd = bench.parameters[n], float(np.sqrt(covariance[k, k]))
        kind = "recording" if "@" in n else "effect" if n in own else "unit"
        said = _name(n, found.machine.words.get(n.partition("@")[0].rpartition(".")[2], ""))
        out.append(Number(_name(n), kind, p.off, after[n], sd, bench.prior(n)[1], p.units, said))
    width = np.sqrt(np.diag(covariance))[kept]
    listed = {e.id for e in found.machine.effects} & set(fitted.leading.units)
    found_numbers = Numbers(out, covariance[np.ix_(kept, kept)] / np.outer(width, width))
    return as_told(found_numbers, found.verdict, listed)


def _name(name: str, words: str = "") -> str:
    """An effect and its parameter, by its key or in words."""
    effect, _, short = name.rpartition(".")
    return f"{effect.replace('_', ' ')}: {words or short}" if effect else words or short
