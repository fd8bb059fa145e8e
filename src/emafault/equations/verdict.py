"""The verdict, in the format of ``diagnosis.json``, from where a bench's search ended."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from ..diagnosis.evidence import Definite, Normal, Reduced
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.naming import POSSIBLE, Reading, possible_place, told_sets
from ..diagnosis.point import is_parameter
from ..diagnosis.search import Search
from ..diagnosis.sets import Model
from ..diagnosis.shown import another_form_of, curve
from ..diagnosis.where import where
from ..effects import EFFECTS
from ..faults import FAULT_NAMES
from ..io.recording import Recording
from ..reporting.numbers import TOLD
from . import carried, regulator, telling
from .held_out import HeldOut
from .how_far import null, shrinks
from .machine import ReferenceActuator
from .parameters import BEYOND, GAINS, OF_LAW
from .point import SEEDED
from .quality import at_a_glance, told
from .telling import EQUATION, Z
from .telling_chain import told_of_chain
from .telling_tolerance import told_of_tolerance
from .terms import TERMS

SCHEMA = "2.0"
SAMPLED = 0.02  # of a gain or limit: the controller samples what the recordings have means of


@dataclass(frozen=True)
class Fitted:
    """Where a bench's search ended, what its sets say, and what the confirm recordings said of that."""

    machine: ReferenceActuator
    bench: Bench
    fit: Fit
    reading: Reading
    held_out: HeldOut | None

    @cached_property
    def leading(self) -> Model:
        """The set that is told."""
        named = self.reading.named + tuple(g for q in self.reading.groups for g in q)
        return self.reading.sets[0][2] if self.reading.sets and named else self.fit.models[0]

    @cached_property
    def before(self) -> dict[str, float]:
        """All parameters of the recalibrated nominal model."""
        return null(self.bench, self.fit).values()

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameters at the leading set's fit."""
        return self.bench.inserted(self.leading, self.fit.normal).values

    @property
    def changes(self) -> Mapping[str, float]:
        """By effect, log odds that it has another size in each recording."""
        return self.held_out.changes if self.held_out else {}


def verdict_of(
    name: str,
    split: tuple[Sequence[str], Sequence[str]],
    fitted: Fitted,
    sealed: Mapping[str, Any],
    recordings: Mapping[str, Recording],
    quality: Mapping[str, Any],
) -> dict[str, Any]:
    """The verdict on a bench.

    Parameters
    ----------
    split : names of the recordings that explore and of those that confirm
    sealed : what the explored recordings said before the others were opened
    quality : of the recordings, by name: see ``quality.seen``
    """
    bench, machine, reading = fitted.bench, fitted.machine, fitted.reading
    found = where(bench.signals(_from_off(bench, fitted.leading)), EQUATION)
    listed = [u.id for u in bench.units if u.kind in ("structural", "calibration")]
    faults = _faults(fitted, recordings)
    discovered = [*told(quality), *_discovered(fitted)]
    which = _which(fitted, found)
    before, after = _simulators(fitted, which)
    out: dict[str, Any] = {
        "bench": name, "schema": SCHEMA, "twin": "actuator", "verdict": reading.verdict, "sealed": sealed,
        "before_confirm": sealed["verdict"], "digest": sealed["digest"],
        "recordings": {"explore": list(split[0]), "confirm": list(split[1])},
        "where": found, "which": which,
        "inclusion": {e: round(float(reading.inclusion.get(e, 0.0)), 5) for e in (*listed, *machine.observed())},
        "discovered": discovered, "quality": at_a_glance(quality), "groups": [list(g) for g in reading.groups],
        "controller": _controller(fitted), "fault_vector": faults, "biased_outputs": _biased(faults),
        "shrinks": shrinks(bench, fitted.held_out, faults, recordings, discovered, reading.told),
        "simulator": {"before": before, "after": after},
    }  # fmt: skip
    if fitted.held_out is not None:
        out["held_out"] = {e: round(r, 3) for e, r in fitted.held_out.ratios.items()}
    return out | {"next_experiment": [], "warnings": []}


def _from_off(bench: Bench, model: Model) -> dict[str, float]:
    """A model's own parameters as deviations from off, by the name of their columns."""
    out: dict[str, float] = {}
    for n, d in model.deviations.items():
        if not is_parameter(n):
            if n.startswith("remainder."):
                out[n] = d
            continue
        p = bench.parameters[n]
        out[p.alias or n] = out.get(p.alias or n, 0.0) + d - bench.prior(n)[2]
    return out


def _parameters(bench: Bench, machine: ReferenceActuator, effects: Sequence[str], model: Model) -> dict[str, dict]:
    """Fitted catalogue parameters of a set with 90 % intervals."""
    out: dict[str, dict] = {}
    for effect in effects:
        if effect in machine.observed():
            step = machine.observed()[effect]["step"]
            reported = {"step": (step, 1e-3 * step)}
        else:
            reported = _reported(bench, effect, model)
        for name, (value, sd) in reported.items():
            known = EFFECTS[effect].parameters.get(name)
            units = known.units if known else {"C": "J/K"}.get(name, "1")
            key = name if name not in out else f"{effect}.{name}"
            out[key] = {"value": value, "low": value - Z * sd, "high": value + Z * sd, "units": units, "effect": effect}
    return out


def _reported(bench: Bench, effect: str, model: Model) -> dict[str, tuple[float, float]]:
    values, spread = {}, {}
    for n, d in model.deviations.items():
        if not is_parameter(n):
            continue
        p = bench.parameters[n]
        if n.split(".")[0].split("#")[0] != effect:
            continue
        if p.secant is not None:
            for full, at in p.secant.items():
                off = bench.parameters[full].off
                values[full.split(".", 1)[1]] = off + (at - off) * (d if full == next(iter(p.secant)) else 1.0)
                spread[full.split(".", 1)[1]] = abs(at - off) * model.spread[n]
            continue
        short = n.split(".", 1)[1].rstrip("+")
        values[short] = bench.after({n: d})[n] + (bench.point[p.alias] if p.alias else 0.0)
        spread[short] = model.spread[n]
    report = getattr(TERMS[effect], "report", None)
    if report is not None and values:
        return report(values, spread)
    return {n: (v, spread[n]) for n, v in values.items()}


def _which(fitted: Fitted, found: Sequence[Mapping]) -> list[dict[str, Any]]:
    """Sets with their probabilities and parameters, see ``told_sets``."""
    left = possible_place(fitted.reading)
    equation = EQUATION.get(left, left) if left else str(found[0]["equation"]) if found else "electrical"
    return told_sets(
        fitted.reading, fitted.fit.search,
        lambda effects, model: _parameters(fitted.bench, fitted.machine, effects, model), equation,
    )  # fmt: skip


def _discovered(fitted: Fitted) -> list[dict]:
    """Forms that no catalogue lists, and remainders, as the verdict tells them."""
    bench, fit, reading, model = fitted.bench, fitted.fit, fitted.reading, fitted.leading
    out = []

    @cache
    def partly(but: tuple[str, ...]) -> Reduced:
        return bench.reduce(fit.normal, but) if but else fit.search.reduced

    for form in reading.forms:
        out.append(
            {
                "unit": form, "probability": float(reading.inclusion[form]), "closed": None,
                "another_form_of": another_form_of(partly, fit.search, form, model.deviations),
                "recordings": list(bench.recordings), **_described(fitted, form, model),
            }
        )  # fmt: skip
    for left in reading.left:
        equation = left.split(":", 1)[1]
        instead = [] if left in reading.remainders else _perhaps(fitted, equation)
        out.append(
            {
                "unit": left, "equation": EQUATION.get(equation, equation), "along": "time", "form": "remainder",
                "probability": float(reading.places[equation]), "closed": None,
                "another_form_of": another_form_of(partly, fit.search, left, model.deviations), "parameters": {},
                "recordings": list(bench.recordings),
                "sentence": remainder_sentence(fit.search, equation, fitted.changes, instead),
            }
        )  # fmt: skip
    return out


def _linear(bench: Bench, form: str, model: Model) -> dict[str, tuple[float, float]]:
    """Coefficients of a form as a set has them, and their standard deviations, by name."""
    unit = next(u for u in bench.units if u.id == form)
    return {
        p.name: (bench.after({p.name: model.deviations[p.name]})[p.name], model.spread[p.name])
        for p in unit.parameters
        if p.name in model.deviations
    }


def _in_words(fitted: Fitted, form: str, model: Model) -> dict[str, Any]:
    """A form as a set has it: where it is, with its parameters and a sentence."""
    bench, machine, linear = fitted.bench, fitted.machine, _linear(fitted.bench, form, model)
    described = {d.id: d for d in bench.described}
    unit = next(u for u in bench.units if u.id == form)
    if form in described:
        return telling.told(described[form], linear, machine.actuator)
    if form.startswith(BEYOND):
        effect = form.removeprefix(BEYOND)
        found = _parameters(bench, machine, (effect,), model)
        return told_of_tolerance(effect, unit.equations[0], found, bench.parameters)
    units = {p.name: p.units for p in unit.parameters}
    return told_of_chain(form, unit.equations[0], linear, units, machine.actuator)


def _described(fitted: Fitted, form: str, model: Model) -> dict[str, Any]:
    """The same, with the curve of one that a scan has proposed and the entry of a simulation that it is."""
    bench, machine, linear = fitted.bench, fitted.machine, _linear(fitted.bench, form, model)
    described = {d.id: d for d in bench.described}
    entry = _in_words(fitted, form, model)
    if form in described:
        values = bench.point | {n: v for n, (v, _) in linear.items()}
        blocks = [b for r in bench.recordings for b in bench.machine.blocks(values, r, wanted=())]
        seen = curve(bench.machine, described[form], blocks, bench.carried, values)
        entry["curve"] = telling.picture(described[form], seen, machine.actuator)
        entry["term"] = carried.of_form(described[form], linear, list(bench.recordings), machine.actuator)
    elif form.startswith(BEYOND):
        entry["term"] = None  # a value of the unit's own, among those of the simulator
    else:
        lengths = {n: r.size * r.interval for n, r in bench.machine.recordings.items()}
        entry["term"] = carried.of_chain(form, linear, lengths)
    return entry


def _perhaps(fitted: Fitted, equation: str) -> list[str]:
    """What an equation may leave, in words, with its probability: forms that are not sure, the likeliest first."""
    reading, acts = fitted.reading, {u.id: u.equations[0] for u in fitted.bench.units if u.kind == "form"}
    likely = {
        u: p for u, p in reading.inclusion.items() if p > POSSIBLE and acts.get(u) == equation and u not in reading.told
    }
    out = []
    for form in sorted(likely, key=lambda u: -likely[u]):
        model = next(m for m in fitted.fit.models if form in m.units)
        says = _in_words(fitted, form, model)["sentence"].partition(": ")[2].rstrip(".")
        out.append(f"{says} ({100.0 * likely[form]:.0f} %)")
    return out


def remainder_sentence(search: Search, equation: str, changes: Mapping[str, float], instead: Sequence[str] = ()) -> str:
    """What an equation leaves, and what it looks like in each recording, were it of one size in all; ``instead``:
    descriptions of it that are not sure."""
    like = [
        TERMS[e].SENTENCE
        for e, odds in changes.items()
        if odds > 0.0 and equation.startswith(tuple(search.units[e].equations))
    ]
    where = f"The {EQUATION.get(equation, equation).replace('_', ' ')} equation leaves more than noise"
    said = f"{where}{' at the commutations' if equation == 'commutation' else ''}, not described further."
    if instead:
        said = f"{where}: perhaps {', or '.join(instead)}."
    if like:
        said += f" In each recording by itself it looks as if {', or '.join(like)}, by another amount each time."
    return said


def _controller(fitted: Fitted) -> dict[str, dict]:
    """The controller's gains as fitted in the control equation, and those of its limits and its band that show."""
    bench, fit, values = fitted.bench, fitted.fit, fitted.values
    index = fit.normal.index
    n = [x for x in bench.nuisances if x.startswith("controller.")]
    beside = [u for u in bench.units if u.id in fitted.reading.forms and u.of_controller]
    n += [p.name for u in beside for p in u.parameters if p.name in index]
    if "remainder:control" in fitted.reading.left:  # which may stand in for a gain
        n += [x for x in index if x.startswith("remainder.control.")]
    k = np.array([index[x] for x in n])
    prior = np.array([1.0 / bench.prior(x)[1] ** 2 for x in n])
    covariance = Definite(fit.normal.H[np.ix_(k, k)] + np.diag(prior)).solve(np.eye(len(k)))
    found = {}  # value, standard deviation and unit
    for name, units in OF_LAW.items():
        full = f"controller.{name}"
        sd = float(np.sqrt(covariance[n.index(full), n.index(full)]))
        if name in GAINS or sd < TOLD * bench.parameters[full].sd:  # a limit that is not reached does not show
            found[name] = values[full], sd, units
    shown = regulator.settings(fitted.machine, bench.recordings, values)
    found |= {name: (value, sd, "A") for name, (value, sd) in shown.items()}
    out = {}
    for name, (value, sd, units) in found.items():
        half, nominal = Z * float(np.hypot(sd, SAMPLED * abs(value))), getattr(fitted.machine.actuator, name)
        out[name] = {"value": value, "low": value - half, "high": value + half, "units": units, "nominal": nominal}
    return out


def covariance_of(bench: Bench, normal: Normal, model: Model) -> tuple[dict[str, int], np.ndarray]:
    """Places of the nuisances and a model's own parameters, and the posterior covariance with all of them free."""
    names = [*bench.nuisances, *(n for n in model.deviations if is_parameter(n))]
    k = np.array([normal.index[n] for n in names])
    sd = np.array([bench.prior(n)[1] for n in names])
    A = normal.H[np.ix_(k, k)] * np.outer(sd, sd) + np.eye(len(k))
    return {n: k for k, n in enumerate(names)}, Definite(A).solve(np.eye(len(k))) * np.outer(sd, sd)


def _faults(fitted: Fitted, recordings: Mapping[str, Recording]) -> dict[str, dict]:
    """By recording the fault vector before and after, with 90 % intervals."""
    bench = fitted.bench
    out: dict[str, dict] = {}
    index, covariance = covariance_of(bench, fitted.fit.normal, fitted.leading)
    for name in bench.recordings:
        rec = bench.machine.recordings[name]
        out[name] = {"before": {}, "after": {}}
        for component in FAULT_NAMES:
            shift = rec.dT_measured if component == "dT" else 0.0
            parts = [component if component != "dT" and rec.health == "unknown" else f"{component}@{name}"]
            if component != "dT" and rec.health == "seeded":
                parts.append(SEEDED + component)
            if component == "dT":
                parts.append(f"ambient.start@{name}")
            k = [index[n] for n in parts if n in index]
            sd = float(np.sqrt(covariance[np.ix_(k, k)].sum()))
            for stage, values in (("before", fitted.before), ("after", fitted.values)):
                value = float(sum(values[n] for n in parts)) + shift
                if component.startswith("N") and len(parts) > 1:  # shares of the turns multiply
                    value -= float(np.prod([values[n] for n in parts]))
                out[name][stage][component] = {"value": value, "low": value - Z * sd, "high": value + Z * sd}
    return out


def _biased(vectors: Mapping[str, dict]) -> dict[str, float]:
    out = {}
    for component in FAULT_NAMES:
        shift = [v["before"][component]["value"] - v["after"][component]["value"] for v in vectors.values()]
        width = [v["after"][component]["high"] - v["after"][component]["low"] for v in vectors.values()]
        if shift and abs(np.mean(shift)) > 0.25 * np.mean(width):
            out[component] = float(np.mean(shift))
    return out


def _simulators(fitted: Fitted, which: Sequence[Mapping]) -> tuple[dict, dict]:
    """The unit before anything was found and after, as parameters of the catalogue."""
    named = [{**p, "name": n.split(".", 1)[-1]} for entry in which[:1] for n, p in entry.get("parameters", {}).items()]
    before = _simulator(fitted.bench, fitted.before, ())
    # what is described changes the unit as well as an effect does
    changed = named or fitted.reading.forms
    return before, _simulator(fitted.bench, fitted.values, named) if changed else before


def _simulator(bench: Bench, values: Mapping[str, float], found: Sequence[Mapping]) -> dict[str, dict[str, float]]:
    """The unit's tolerances and named effects as parameters of the catalogue: effect -> parameter -> value."""
    out: dict[str, dict[str, float]] = {}
    for n in bench.nuisances:
        if "@" not in n and "." in n and n.split(".")[0] in EFFECTS:
            effect, name = n.split(".", 1)
            out.setdefault(effect, {})[name] = float(values[n])
    for p in found:
        effect = p["effect"]
        if p["name"] in EFFECTS[effect].parameters:
            out.setdefault(effect, {})[p["name"]] = float(p["value"])
    late = carried.of_sensor(values, bench.machine.recordings[bench.recordings[0]].interval)
    if late:
        found_late = out.setdefault("speed_latency", {"tau": 0.0})
        found_late["tau"] += late
    return out
