"""Whether a fitted set leaves more in recordings that took no part than anything free would leave there: a predictive
check of the model by itself, without a rival to it (Box 1980, Journal of the Royal Statistical Society A 143, 383).

Where no set of the search is the true one, a nuisance may take up what acts, at a value that its prior all but rules
out: the linear model has the recordings explained, the fit keeps to the prior, and no column of a remainder is missing.
"""

from collections.abc import Sequence

import numpy as np

from .fit import Bench, Fit
from .linear import White
from .model import SETTINGS
from .point import is_parameter
from .set_prior import REMAINDER_ODDS
from .sets import Model


def log_odds(bench: Bench, fit: Fit, model: Model, confirm: Sequence[White]) -> dict[str, float]:
    """Log posterior odds by equation that other values than the fitted ones act in the recordings that confirm, those
    of the controller left out.

    Weights give a recording the mean square of one that is left with everything at its best. What is beyond it is twice
    the log likelihood ratio of the best values over the fitted ones, of which Schwarz's criterion (1978, Annals of
    Statistics 6, 461) takes the number of what is free.

    Parameters
    ----------
    bench, fit : that the set was fitted by
    confirm : whitened blocks of the recordings that confirm, under the fitted set
    """
    free = {*bench.nuisances, *(n for n in model.deviations if is_parameter(n))}
    beyond: dict[str, float] = {}
    rows: dict[str, int] = {}
    for w in confirm:
        if w.equation not in SETTINGS:
            beyond[w.equation] = beyond.get(w.equation, 0.0) + float(w.gram[-1, -1]) - w.count
            rows[w.equation] = rows.get(w.equation, 0) + w.count
    acting: dict[str, set[str]] = {}
    for w in fit.whites:
        power = np.diag(w.gram)
        acting.setdefault(w.equation, set()).update(
            n for n, p in zip(w.names, power, strict=False) if p > 0.0 and n in free and "@" not in n
        )
    return {
        e: REMAINDER_ODDS + 0.5 * (x - len(acting.get(e, ())) * float(np.log(max(rows[e], 1))))
        for e, x in beyond.items()
    }
