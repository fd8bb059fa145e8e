"""Forms that the explored recordings show and of which those set aside say nothing: they hardly pass where it is."""

from typing import Any

import numpy as np

from ..diagnosis.described import Described
from ..diagnosis.evidence import CLEAR
from ..diagnosis.forms import FORMS
from ..diagnosis.linear import white_rows
from .telling import told
from .verdict import Fitted


def unconfirmed(fitted: Fitted) -> list[dict[str, Any]]:
    """Warnings of described forms that the recordings set aside neither confirmed nor could have.

    One that is as the explored recordings have it would gain there half the squared size of its signal, in units of
    the noise, on average. Forms of another size in each recording are not asked.
    """
    held_out = fitted.held_out
    if held_out is None:
        return []
    out = []
    for form in fitted.bench.described:
        ratio = held_out.ratios.get(form.id)
        if ratio is None or abs(ratio) >= CLEAR or FORMS[form.word].EACH:
            continue
        explored = held_out.explored
        model = next((m for m in explored.fit.models if form.id in m.units), None)
        if model is None:
            continue
        values = explored.bench.inserted(model, explored.fit.normal).values
        found = {n: values[n] for n in form.names(explored.bench.recordings[0])}
        if _expected(fitted, form, found) < CLEAR:
            sentence = told(form, {n: (v, 0.0) for n, v in found.items()}, fitted.machine.actuator)["sentence"]
            message = "not told, for the recordings set aside to confirm it hardly pass where it shows: "
            out.append(
                {"kind": "unconfirmed", "file": None, "variable": None, "message": message + sentence.rstrip(".")}
            )
    return out


def _expected(fitted: Fitted, form: Described, found: dict[str, float]) -> float:
    """Log predictive ratio that a form of these coefficients is expected to gain on the recordings set aside."""
    assert fitted.held_out is not None
    names, here = list(found), np.array([*found.values()])
    total = 0.0
    for recording in fitted.held_out.explored.ladder.recordings:
        for block in fitted.bench.machine.blocks(dict(fitted.values) | found, recording, wanted=set(names)):
            if names[0] in block.columns:
                _, rows = white_rows(block, names, False)
                total += 0.5 * float(np.sum((rows[:, :-1] @ here) ** 2))
    return total
