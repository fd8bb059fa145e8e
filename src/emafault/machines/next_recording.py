"""What to record next of a measured machine: its own recordings with the condition changed."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..diagnosis.linear import White, compressed, white_rows
from ..diagnosis.search import Search
from ..diagnosis.sets import Model
from .statement import Experiment, Machine, Rows

if TYPE_CHECKING:
    from .diagnose import Fitted

RIVALS = 3
LIKELY = 0.005  # probability from which a set is a rival worth telling from the leading one
TOLD = 5  # experiments in the verdict
MOST = 13.8  # nats, a million to one: more is no more decided


def next_recordings(machine: Machine, fitted: "Fitted") -> list[dict[str, Any]]:
    """Experiments of the machine's menu by the odds that they should bring between the leading set and a rival.

    Each imagined recording is what the leading set predicts under the changed inputs; its normal matrix joins those of
    the recordings, and the change of the difference in log evidence is what it brings.
    """
    listed = {u.id for u in fitted.bench.units}
    leading = fitted.leading
    mine = {u for u in leading.units if u in listed}
    rivals: dict[tuple[str, ...], Model] = {}
    mass = {s: p for s, p, _ in fitted.reading.sets} | {(): fitted.reading.empty + fitted.reading.unknown}
    for model in fitted.fit.models:
        names = tuple(sorted(u for u in model.units if u in listed))
        if set(names) != mine:
            rivals.setdefault(names, model)
    kept = ([x for x in rivals.items() if mass.get(x[0], 0.0) > LIKELY] or list(rivals.items()))[:RIVALS]
    usual = [r for r in machine.rows if r.recording == machine.explore[0]]
    found = []
    again = Experiment("the same once more", lambda x: {})
    for experiment in (again, *machine.experiments):
        rows = [_imagined(r, experiment) for r in usual]
        if experiment is not again and all(r.inputs is u.inputs for r, u in zip(rows, usual, strict=True)):
            continue
        search = _with(fitted, rows, fitted.settled.values)
        for names, rival in kept:
            members = [tuple((c.unit, c.variant) for c in m.choices) for m in (leading, rival)]
            if not all(m in search.candidates for pair in members for m in pair):
                continue
            a, b = (search.fit(m).log_likelihood for m in members)
            gain = (a - b) - (leading.log_likelihood - rival.log_likelihood)
            pair = ["+".join(sorted(mine)) or "no effect", "+".join(names) or "no effect"]
            found.append((gain, experiment.text, pair))
    found.sort(key=lambda x: (-x[0], x[1]))
    return [
        {
            "command": text, "ambient_temperature": None, "separates": pair,
            "expected_odds": float(np.exp(np.clip(gain, 0.0, MOST))),
        }
        for gain, text, pair in found[:TOLD]
    ]  # fmt: skip


def _imagined(rows: Rows, experiment: Experiment) -> Rows:
    changed = {n: x for n, x in experiment.change(rows.inputs).items()}
    same = all(np.array_equal(x, rows.inputs[n]) for n, x in changed.items())
    inputs = rows.inputs if same else {**rows.inputs, **changed}
    return replace(rows, inputs=inputs, variance=np.diag(rows.covariance), shared=None)


def _with(fitted: "Fitted", rows: list[Rows], values: Mapping[str, float]) -> Search:
    """Sets weighed with an imagined recording beside those that there are."""
    bench, recorded = fitted.bench, fitted.recorded
    columns, _ = bench.columns()
    wanted = [*bench.nuisances, *columns]
    more: list[White] = []
    for r in rows:
        at = replace(r, observed=recorded.predict(r, [values])[0])
        block = recorded.block(at, bench.values(), set(wanted))
        more.append(compressed(block, *white_rows(block, wanted, False), None))
    reduced = bench.reduce(bench.normal([*fitted.fit.whites, *more]))
    return bench.searching(reduced, *bench.candidates(reduced))
