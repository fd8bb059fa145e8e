"""What the recordings set aside say of what the others told: the ladder of residuals, and the predictive density."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import solve_triangular

from ..diagnosis.closure import closed, placebo, rms, rows
from ..diagnosis.evidence import CLEAR
from ..diagnosis.linear import OwnForms, White, assemble, columns_of_forms, own_columns, remainder_columns
from ..diagnosis.point import is_parameter
from .adapter import Recorded

if TYPE_CHECKING:
    from .diagnose import Fitted


def ladder(explored: "Fitted", opened: Recorded, confirm: Sequence[str]) -> dict[str, float | None]:
    """Root mean square of the whitened residual on the recordings set aside, everything frozen.

    ``after`` has what the explored recordings named, with the remainder that they left where there is one. ``opened``
    has all recordings, with the functions of remainders as they were before.
    """
    off = {n: p.off for n, p in opened.parameters.items()}
    recalibrated = off | _general(explored.base())
    base = whitened(opened, confirm, recalibrated)
    leading = explored.leading
    after = rms(base)
    if explored.tells:
        at = explored.settled
        after = with_functions(whitened(opened, confirm, off | _general(at.values), at.own), at.functions)
    signal: dict[str, float | None] = {
        "nominal": rms(whitened(opened, confirm, off)), "recalibrated": rms(base),
        "placebo": placebo(
            explored.at_base, base, sorted({w.equation for w in base}),
            sum(is_parameter(n) for n in leading.deviations),
        )[0],
        "after": after, "floor": 1.0,
    }  # fmt: skip
    return signal | {"closed": closed(rms(base), after, 1.0, rows(base))}


def _general(values: Mapping[str, float]) -> dict[str, float]:
    """Values without the errors that belong to one recording."""
    return {n: v for n, v in values.items() if "@" not in n}


def whitened(
    recorded: Recorded,
    recordings: Sequence[str],
    values: Mapping[str, float],
    own: OwnForms | None = None,
) -> list[White]:
    """Residuals at frozen values under the covariance of all errors together, with the functions of remainders and of
    the units that carry their ``own`` form."""
    out = []
    for name in recordings:
        for r in recorded.rows[name]:
            block = recorded.block(r, values, columns_of_forms(own))
            names, columns = remainder_columns(block, float(np.sqrt(np.median(r.variance))))
            for unit, form in (own or {}).items():
                more, extra = own_columns(block, unit, form)
                names, columns = names + more, columns + extra
            lower = np.linalg.cholesky(r.covariance)
            white = solve_triangular(lower, np.column_stack([*columns, block.residual]), lower=True)
            out.append(White(name, r.equation, names, white.T @ white, r.size))
    return out


def closed_by(signal: Mapping[str, float | None] | None) -> float | None:
    """What a remainder closes together with what is named; alone it is not told apart."""
    return None if signal is None else signal["closed"]


def with_functions(whites: Sequence[White], functions: Mapping[str, float]) -> float:
    """Root mean square with the functions of remainders and own forms at these sizes."""
    names = sorted({n for w in whites for n in w.names if n in functions})
    normal = assemble(whites, names, {})
    d = np.array([functions[n] for n in names])
    power = sum(float(w.gram[-1, -1]) for w in whites) + 2.0 * normal.g @ d + d @ normal.H @ d
    return float(np.sqrt(max(power, 0.0) / max(rows(whites), 1)))


def outcome(explored: "Fitted", whole: "Fitted") -> dict[str, Any]:
    """What the recordings set aside say of what was named before they were opened.

    Returns
    -------
    ``outcome``: ``holds``, they are more probable with it; ``contradicted``, less; ``not seen``, alike; ``rival``, all
    recordings together name something else; ``no claim``, nothing was named. ``log_density``: log predictive density
    of these recordings with what was named less that of the recalibrated base model. ``claimed``: what is left.
    """
    before, after = explored.reading, whole.reading
    sealed = {*before.named, *(e for g in before.groups for e in g)}
    final = {*after.named, *(e for g in after.groups for e in g)}
    if not sealed:
        holds = before.verdict == "no_gap" and after.verdict == "no_gap"
        said = "holds" if holds else "contradicted" if before.verdict == "no_gap" else "no claim"
        return {"outcome": said, "log_density": 0.0, "claimed": sorted(final)}
    listed = {u.id for u in whole.bench.units}
    mine = tuple(c for c in explored.leading.choices if c.unit in listed)
    gain = whole.log_evidence(mine) - explored.log_evidence(mine)
    gain -= whole.log_evidence(()) - explored.log_evidence(())
    said = "holds" if gain > CLEAR else "contradicted" if gain < -CLEAR else "not seen"
    if not set(before.named) <= final:
        said = "rival" if final else "contradicted"
    return {"outcome": said, "log_density": round(float(gain), 3), "claimed": sorted(final)}
