"""A measured machine's verdict in the format of ``diagnosis.json``, schema 2.0."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..diagnosis.naming import possible_place, told_sets
from ..diagnosis.point import is_parameter
from ..diagnosis.sets import Model
from ..diagnosis.where import where
from .held_out import whitened, with_functions
from .statement import Machine, told

if TYPE_CHECKING:
    from .diagnose import Fitted

SCHEMA = "2.0"
Z = 1.645  # standard deviations of a 90 % interval
BIASED = 0.25  # of an interval's width, by which a parameter moves that is told as biased
SEEN = 1.0  # information over that of the prior, below which the recordings say nothing of a parameter


def build(machine: Machine, fitted: "Fitted", sealed: Mapping[str, Any]) -> dict[str, Any]:
    """The verdict of all recordings; what is held out is filled in by whoever opened it."""
    reading = fitted.reading
    found = regions(fitted)
    base = _base(fitted)
    return {
        "bench": machine.case, "schema": SCHEMA, "twin": machine.name, "verdict": reading.verdict,
        "sealed": dict(sealed), "before_confirm": sealed["verdict"], "digest": sealed["digest"],
        "recordings": {"explore": list(machine.explore), "confirm": list(machine.confirm)},
        "where": found,
        "which": _which(machine, fitted, found),
        "inclusion": {e: round(float(reading.inclusion.get(e, 0.0)), 5) for e in _listed(machine)},
        "discovered": _discovered(fitted, found),
        "controller": {},
        "groups": [list(g) for g in reading.groups],
        "untold": untold(fitted),
        "base": base,
        "residual": _residual(fitted),
        "fault_vector": {},
        "biased_outputs": {
            n: b["before"]["value"] - b["after"]["value"]
            for n, b in base.items()
            if abs(b["before"]["value"] - b["after"]["value"]) > BIASED * (b["after"]["high"] - b["after"]["low"])
        },
        "shrinks": {"signal": None, "features": None, "fault_vector": None},
        "held_out": {"outcome": "no claim", "log_density": 0.0, "claimed": []},
        "next_experiment": [], "notes": list(machine.notes), "warnings": [],
    }  # fmt: skip


def _listed(machine: Machine) -> list[str]:
    return [*(e.id for e in machine.effects), *machine.observed]


def regions(fitted: "Fitted") -> list[dict[str, Any]]:
    """Where the gap lies, by equation and coordinate."""
    deviations = fitted.from_off(fitted.leading) if fitted.tells else {}
    blocks = {r.equation for rows in fitted.recorded.rows.values() for r in rows}
    found = where(fitted.bench.signals(deviations), {e: told(e) for e in blocks})
    return [{**entry, "along": fitted.recorded.told_along(entry["along"])} for entry in found]


def _which(machine: Machine, fitted: "Fitted", found: Sequence[Mapping]) -> list[dict[str, Any]]:
    """Sets with their probabilities and parameters, see ``told_sets``."""
    return told_sets(
        fitted.reading, fitted.fit.search,
        lambda effects, model: _parameters(machine, fitted, effects, model), _equation(fitted, found),
    )  # fmt: skip


def _equation(fitted: "Fitted", found: Sequence[Mapping]) -> str:
    """Where what is unknown lies: the remainder's equation, else that with the largest residual."""
    left = possible_place(fitted.reading)
    if left is not None:
        return told(left)
    if found:
        return str(found[0]["equation"])
    return told(next(r.equation for rows in fitted.recorded.rows.values() for r in rows))


def _parameters(machine: Machine, fitted: "Fitted", effects: Sequence[str], model: Model) -> dict[str, dict[str, Any]]:
    """Fitted parameters of a set with 90 % intervals."""
    bench = fitted.bench
    units = {fitted.recorded.names[p.name]: p.units for p in machine.parameters}
    out: dict[str, dict[str, Any]] = {}
    for n, d in model.deviations.items():
        if not is_parameter(n):
            continue
        p = bench.parameters[n]
        if p.secant is not None:
            first = next(iter(p.secant))
            reach = {full: at - bench.parameters[full].off for full, at in p.secant.items()}
            values = {full: (at, 0.0) for full, at in p.secant.items()}
            values[first] = (bench.parameters[first].off + d * reach[first], abs(reach[first]) * model.spread[n])
        else:
            values = {n: (bench.after({n: d})[n], model.spread[n])}
        for full, (value, sd) in values.items():
            effect, name = full.split(".", 1)
            if effect in effects:
                out[name] = {
                    "value": value, "low": value - Z * sd, "high": value + Z * sd, "units": units[full],
                    "effect": effect,
                }  # fmt: skip
    for effect in set(effects) & set(machine.observed):
        out |= {n: {"value": v, "low": v, "high": v, "effect": effect} for n, v in machine.observed[effect].items()}
    return out


def _discovered(fitted: "Fitted", found: Sequence[Mapping]) -> list[dict[str, Any]]:
    """Remainders as the verdict tells them, each with where most of it lies."""
    out = []
    for left in fitted.reading.remainders:
        equation = told(left.split(":", 1)[1])
        place: Mapping[str, Any] = next((w for w in found if w["equation"] == equation), {"along": "time"})
        text = f"The {equation.replace('_', ' ')} equation leaves more than noise"
        if "from" in place:
            text += f", most of it at {place['along'].replace('_', ' ')} {place['from']:z.3g} to {place['to']:z.3g}"
        out.append(
            {
                "unit": left, "equation": equation, "along": place["along"], "form": "remainder",
                "probability": min(1.0, float(fitted.reading.inclusion[left])), "closed": None,
                "another_form_of": None, "parameters": {}, "recordings": list(fitted.bench.recordings),
                "sentence": f"{text}; it is not described further.",
            }
        )  # fmt: skip
    return out


def covariance_of(fitted: "Fitted") -> tuple[list[str], np.ndarray]:
    """Parameters of the base model and of the leading set, and their posterior covariance."""
    bench, normal = fitted.bench, fitted.fit.normal
    own = (n for n in fitted.leading.deviations if n in normal.index and is_parameter(n))
    names = [*bench.nuisances, *own]
    k = np.array([normal.index[n] for n in names])
    sd = np.array([bench.prior(n)[1] for n in names])
    A = normal.H[np.ix_(k, k)] * np.outer(sd, sd) + np.eye(len(k))
    return names, np.linalg.inv(A) * np.outer(sd, sd)


def _base(fitted: "Fitted") -> dict[str, dict[str, Any]]:
    """Parameters of the base model before and after, with 90 % intervals."""
    bench = fitted.bench
    before, after = fitted.base(), fitted.settled.values
    names, covariance = covariance_of(fitted)
    spread = dict(zip(names, np.sqrt(np.diag(covariance)), strict=True))
    out = {}
    for n in bench.nuisances:
        if n in fitted.recorded.short:
            s = Z * float(spread[n])
            units = bench.parameters[n].units
            out[n] = {
                stage: {"value": v[n], "low": v[n] - s, "high": v[n] + s, "units": units}
                for stage, v in (("before", before), ("after", after))
            }
    return out


def _residual(fitted: "Fitted") -> dict[str, dict[str, float]]:
    """Root mean square of each equation's whitened residual, of the recalibrated base model and of the named set."""
    out: dict[str, dict[str, float]] = {}
    at = fitted.settled
    own = {n: d for n, d in at.functions.items() if n.startswith("own.")} if fitted.tells else {}
    for stage, values in (("before", fitted.base()), ("after", at.values)):
        general = {n: 0.0 if "@" in n else v for n, v in values.items()}
        whites = whitened(fitted.recorded, fitted.bench.recordings, general, at.own)
        for equation in dict.fromkeys(told(w.equation) for w in whites):
            mine = [w for w in whites if told(w.equation) == equation]
            out.setdefault(equation, {})[stage] = with_functions(mine, own if stage == "after" else {})
    return out


def untold(fitted: "Fitted") -> list[str]:
    """Effects of which these recordings say nothing: what they would show is the base model's doing as well."""
    reduced, bench = fitted.fit.search.reduced, fitted.bench
    out = []
    for unit in bench.units:
        names = [p.name for v in bench.active(unit) for p in v.parameters if p.name in reduced.index]
        information = [reduced.M[k, k] * bench.prior(n)[1] ** 2 for n in names for k in [reduced.index[n]]]
        if max(information, default=0.0) < SEEN:
            out.append(unit.id)
    return out
