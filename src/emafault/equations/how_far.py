"""How far the gap shrinks on the recordings that took no part: the ladder in signal, features and fault vector."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from ..diagnosis.closure import closed, coefficients, placebo, rms, rows
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.linear import White
from ..diagnosis.naming import read
from ..diagnosis.point import is_parameter
from ..diagnosis.sets import Choice, Model
from ..io.recording import Recording
from . import electrical
from .held_out import HeldOut
from .parameters import FAULTS, OF_LAW
from .point import SEEDED
from .predicted import Explored
from .telling import Z

#: what the controller's owner may set is no part of a gap, and recordings set aside may tell what the others do not
CONTROLLER_SETTINGS = [f"controller.{name}" for name in OF_LAW]


def null(bench: Bench, fit: Fit) -> Bench:
    """The recalibrated nominal model: the nuisances alone, on the same recordings."""
    out = Bench(bench.machine, bench.recordings, bench.processes)
    out.carried, out.workers = bench.carried, bench.workers
    at = bench.inserted(fit.search.fit(()), fit.normal).values
    out.point |= {n: at[n] for n in bench.nuisances}
    return out


def shrinks(
    bench: Bench,
    held_out: HeldOut | None,
    vectors: Mapping[str, dict],
    recordings: Mapping[str, Recording],
    found: list[dict],
    told: Collection[str],
) -> dict[str, Any]:
    """The ladder on the confirm recordings; enters what each described form closes alone.

    ``told``: units that the verdict tells. What the explored recordings had beside them and the others have refused is
    not inserted, but where it stands for a remainder that is told.
    """
    if held_out is None:
        return {"signal": None, "features": None, "fault_vector": None}
    explored = held_out.explored
    ladder, fit = explored.ladder, explored.fit
    reading = read(fit.models, fit.search.units.values())
    leading = reading.sets[0][2] if reading.named or reading.groups else fit.models[0]
    models = _insertable(fit, leading, told)
    model = models[0]
    off = {n: p.off for n, p in bench.parameters.items()}
    nominal_unit = null(explored.bench, fit)
    recalibrated = {**off, **nominal_unit.values()}
    nominal = {n: recalibrated[n] if n.split("@")[0].removeprefix(SEEDED) in FAULTS else v for n, v in off.items()}
    base = ladder.blocks(recalibrated, remainders=True, settings=CONTROLLER_SETTINGS)
    mine = [n for n in model.deviations if is_parameter(n)]
    best, after = min(
        (_inserted(explored, m, recalibrated) for m in models),
        key=lambda found: rms(found[0]),
    )
    at_nominal = ladder.blocks(nominal, remainders=True, settings=CONTROLLER_SETTINGS)
    units = {u.id: u for u in explored.bench.units}
    equations = sorted({q for u in model.units if u in units for e in units[u].equations for q in _blocks_of(e)})
    count = rows(base)
    left = Model(tuple(Choice(f"remainder:{e}", 0, 1.0) for e in equations))
    at_null = nominal_unit.normal(nominal_unit.linearise(left), left)
    median, middle = placebo(at_null, base, equations, len(mine))
    signal: dict[str, float | None] = {
        "nominal": rms(at_nominal), "recalibrated": rms(base),
        "placebo": median, "after": rms(best), "floor": 1.0,
    }  # fmt: skip
    signal["closed"] = closed(rms(base), rms(best), 1.0, count)
    features = _feature_ladder(at_nominal, base, middle, best)
    for entry in found:
        form = units.get(entry["unit"])
        if form is not None and form.id in model.units:
            if set(model.units) == {form.id}:  # by itself it is all that was inserted
                entry["closed"] = signal["closed"]
                continue
            own = {n: after[n] for p in form.parameters for n in (p.name, p.alias) if n}
            alone = ladder.blocks(recalibrated | own, also=list(own), settings=CONTROLLER_SETTINGS)
            entry["closed"] = closed(rms(base), rms(alone), 1.0, count)
    return {
        "signal": signal,
        "features": features,
        "fault_vector": _fault_ladder(ladder.recordings, vectors, recordings),
    }


def _insertable(fit: Fit, leading: Model, told: Collection[str]) -> list[Model]:
    """What of a leading set may be inserted: what is told with what stands for a remainder that is; what is told alone;
    and that without its remainders, which need not carry over to other recordings."""
    left = {u.split(":", 1)[1] for u in told if u.startswith("remainder:")}
    acting = {c.unit: {b for e in fit.search.units[c.unit].equations for b in _blocks_of(e)} for c in leading.choices}
    kept = [c for c in leading.choices if c.unit in told or left & acting[c.unit]]
    alone = [c for c in kept if c.unit in told]
    plain = [c for c in alone if not c.unit.startswith("remainder:")]
    sets = dict.fromkeys(tuple((c.unit, c.variant) for c in some) for some in (kept, alone, plain))
    return [fit.search.fit(members) for members in sets]


def _inserted(
    explored: Explored, model: Model, recalibrated: Mapping[str, float]
) -> tuple[list[White], dict[str, float]]:
    """Blocks of the confirm recordings with a set inserted, and its values."""
    inserted = explored.bench.inserted(model, explored.fit.normal)
    after = {**recalibrated, **inserted.values}
    mine = [n for n in model.deviations if is_parameter(n)]
    blocks = explored.ladder.blocks(after, remainders=True, also=mine, inserted=inserted, settings=CONTROLLER_SETTINGS)
    return blocks, after


def _feature_ladder(
    nominal: list[White], base: list[White], placebos: list[White], best: list[White]
) -> dict[str, float | None] | None:
    """Resistance and back-EMF coefficient of each phase and recording less the model's, over their standard errors."""
    found = {
        stage: coefficients([w for w in whites if w.equation in electrical.NAMES])
        for stage, whites in (("nominal", nominal), ("recalibrated", base), ("placebo", placebos), ("after", best))
    }
    count = found["recalibrated"][1]
    if not count:
        return None
    ladder: dict[str, float | None] = {stage: value for stage, (value, _) in found.items()}
    share = closed(found["recalibrated"][0], found["after"][0], 1.0, count)
    return ladder | {"floor": 1.0, "closed": share}


def _blocks_of(equation: str) -> tuple[str, ...]:
    """Blocks of an equation as the catalogue names it."""
    return ("electrical_a", "electrical_b", "electrical_c") if equation == "electrical" else (equation,)


def _fault_ladder(
    confirm: Sequence[str], vectors: Mapping[str, dict], recordings: Mapping[str, Recording]
) -> dict[str, float | None] | None:
    """Root mean square error of the fault vector over its own uncertainty, where the truth is known."""
    errors: dict[str, list[float]] = {"before": [], "after": []}
    for name in confirm:
        truth = recordings[name].fault
        if truth is None:
            continue
        for stage, found in errors.items():
            for value, (component, known) in zip(truth, vectors[name][stage].items(), strict=True):
                sd = (vectors[name]["after"][component]["high"] - vectors[name]["after"][component]["low"]) / (2.0 * Z)
                found.append((known["value"] - float(value)) / max(sd, 1e-9))
    if not errors["before"]:
        return None
    before, after = (float(np.sqrt(np.mean(np.square(e)))) for e in errors.values())
    return {
        "nominal": before, "recalibrated": before, "placebo": None, "after": after, "floor": 1.0,
        "closed": closed(before, after, 1.0, len(errors["before"])),
    }  # fmt: skip
