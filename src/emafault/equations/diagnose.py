"""Diagnosis of a bench of the reference actuator by equation errors: from recordings to the verdict."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..diagnosis import wandering
from ..diagnosis.closure import Ladder
from ..diagnosis.described import another_form_of, curve
from ..diagnosis.evidence import Definite, Normal, Reduced
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.naming import Reading, read
from ..diagnosis.point import is_parameter
from ..diagnosis.search import Model, Search
from ..diagnosis.where import where
from ..effects import EFFECTS
from ..effects.scaling import scaled
from ..errors import InputError
from ..faults import FAULT_NAMES
from ..io.recording import Recording
from . import carried, telling
from .held_out import HeldOut, held_to_account
from .how_far import null, shrinks
from .machine import ReferenceActuator
from .next_recording import LIKELY, RIVALS, next_recordings
from .point import SEEDED
from .quality import at_a_glance, seen, told
from .signals import Signals, estimated_noise
from .telling import EQUATION, Z
from .terms import TERMS

SCHEMA = "2.0"
CONTROLLER = {"position_gain": "1/s", "speed_gain": "A s/rad", "speed_integral_gain": "A/rad"}
SAMPLED = 0.02  # of a gain: the controller samples what the recordings have means of


@dataclass(frozen=True)
class Diagnosed:
    """A verdict with the fit that it rests on."""

    verdict: dict[str, Any]
    bench: Bench
    fit: Fit
    reading: Reading
    leading: Model
    before: Mapping[str, float]  # all parameters of the recalibrated nominal model
    values: Mapping[str, float]  # of all parameters at the leading set's fit
    noise: SensorNoise

    def next_experiments(self) -> list[dict[str, Any]]:
        """What to record next: see ``next_recordings``."""
        listed = {u.id for u in self.bench.units if u.kind in ("structural", "calibration")}
        mine = {u for u in self.leading.units if u in listed}
        rivals: dict[tuple[str, ...], Model] = {}
        for model in self.fit.models:
            names = tuple(sorted(u for u in model.units if u in listed))
            if set(names) != mine:
                rivals.setdefault(names, model)
        mass = {s: p for s, p, _ in self.reading.sets} | {(): self.reading.empty + self.reading.unknown}
        likely = [(n, m) for n, m in rivals.items() if mass.get(n, 0.0) > LIKELY]
        kept = (likely or list(rivals.items()))[:RIVALS]
        effects = self.verdict["simulator"]["after"]
        return next_recordings(self.bench, self.fit, self.leading, kept, self.values, effects, self.noise)


ENOUGH = 50_000  # samples that a search begins with; what it leads to is fitted to all
FEWEST = 5  # recordings that it begins with


def diagnose(
    name: str,
    recordings: Mapping[str, Recording],
    split: tuple[Sequence[str], Sequence[str]],
    actuator: ActuatorParameters,
    noise: SensorNoise,
    exclude: Sequence[str] = (),
    processes: int = 1,
    tolerances: Mapping[str, Mapping[str, float]] | None = None,
) -> "Diagnosed":
    """Diagnose a bench: its verdict, in the format of ``diagnosis.json``, and the fit that it rests on.

    Parameters
    ----------
    recordings : by name, read and checked
    split : names of those that explore and of those that confirm
    noise : of the sensors, where the recordings do not tell it
    exclude : effects that the library is to lack
    processes : in which recordings are linearised side by side
    tolerances : of this actuator, see ``effects.scaling.scaled``

    Raises
    ------
    InputError : an effect that does not exist
    """
    for effect in exclude:
        if effect not in EFFECTS:
            raise InputError(f"exclude: '{effect}' is not an effect, accepted are {', '.join(EFFECTS)}")
    explore, confirm = split
    own = estimated_noise([recordings[n] for n in explore], noise)
    library = exclude, scaled(actuator, tolerances)
    machine = ReferenceActuator(actuator, {n: Signals.of(n, recordings[n], actuator, own) for n in explore}, *library)
    bench = Bench(machine, list(explore), processes)
    first = _spread(recordings, explore)
    if len(first) < len(explore):
        begun = Bench(machine, first, processes)
        fit = bench.fit((begun, begun.fit()))
    else:
        fit = bench.fit()
    quality = {n: seen(recordings[n]) for n in explore}
    counted = bool(told(quality))
    reading = read(
        fit.models, fit.search.units.values(), tuple(machine.observed()), counted=counted,
        wandering=wandering.log_odds(bench),
    )  # fmt: skip
    sealed = _seal(reading)
    if not confirm:
        return _diagnosed(name, split, machine, bench, fit, reading, sealed, None, recordings, own, quality)
    # from here on the confirm recordings are open
    known = machine.recordings
    signals = {n: known[n] if n in known else Signals.of(n, r, actuator, own) for n, r in recordings.items()}
    whole = ReferenceActuator(actuator, signals, *library)
    every = Bench(whole, list(recordings), processes)
    all_fit = every.fit((bench, fit))
    units, observed = all_fit.search.units.values(), tuple(whole.observed())
    ladder = Ladder(every, confirm)
    named = read(all_fit.models, units, observed).named
    wanders = wandering.log_odds(every, confirm)
    models, ratios, changes = held_to_account(every, all_fit, named, ladder, bench, fit, wanders)
    all_fit = replace(all_fit, models=models)
    quality = {n: quality[n] if n in quality else seen(r) for n, r in recordings.items()}
    final = read(models, units, observed, counted=bool(told(quality)), wandering=wanders)
    held_out = HeldOut(ladder, bench, fit, ratios, changes)
    return _diagnosed(name, split, whole, every, all_fit, final, sealed, held_out, recordings, own, quality)


def _spread(recordings: Mapping[str, Recording], names: Sequence[str]) -> list[str]:
    """As many of the recordings as a search needs to begin with, spread over temperatures, commands and health."""
    order = sorted(
        names,
        key=lambda n: (
            recordings[n].ambient_temperature, recordings[n].attributes.get("health"),
            str(recordings[n].attributes.get("command")), n,
        ),
    )  # fmt: skip
    samples = sum(len(recordings[n].time) for n in names)
    count = min(len(order), max(FEWEST, int(len(order) * ENOUGH / samples)))
    return sorted({order[k] for k in np.linspace(0, len(order) - 1, count).round().astype(int)})


def _seal(reading: Reading) -> dict[str, Any]:
    """What the explored recordings say, with a digest that anyone can recompute."""
    out: dict[str, Any] = {
        "verdict": reading.verdict,
        "which": [{"effects": list(s), "probability": round(p, 5)} for s, p, _ in reading.sets[:8]],
        "discovered": list(reading.forms),
    }
    text = json.dumps(out, sort_keys=True, separators=(",", ":"))
    return out | {"digest": hashlib.sha256(text.encode()).hexdigest()}


def _diagnosed(
    name, split, machine, bench: Bench, fit: Fit, reading: Reading, sealed, held_out, recordings, noise, quality
) -> Diagnosed:
    best = (
        reading.sets[0][2]
        if reading.sets and reading.named + tuple(g for q in reading.groups for g in q)
        else fit.models[0]
    )
    deviations = _from_off(bench, best)
    found = where(bench.signals(deviations), EQUATION)
    verdict: dict[str, Any] = {
        "bench": name, "schema": SCHEMA, "twin": "actuator", "verdict": reading.verdict, "sealed": sealed,
        "before_confirm": sealed["verdict"], "digest": sealed["digest"],
        "recordings": {"explore": list(split[0]), "confirm": list(split[1])},
        "where": found,
    }  # fmt: skip
    verdict["which"] = _which(bench, machine, reading, found, fit.search)
    listed = [u.id for u in bench.units if u.kind in ("structural", "calibration")]
    verdict["inclusion"] = {e: round(float(reading.inclusion.get(e, 0.0)), 5) for e in (*listed, *machine.observed())}
    changes = held_out.changes if held_out else {}
    verdict["discovered"] = [*told(quality), *_discovered(bench, machine, reading, best, fit, changes)]
    verdict["quality"] = at_a_glance(quality)
    verdict["groups"] = [list(g) for g in reading.groups]
    before_point = null(bench).values()
    posterior = covariance_of(bench, fit.normal, best)
    after_values = bench.inserted(best, fit.normal).values
    verdict["controller"] = _controller(bench, fit, reading, after_values)
    verdict["fault_vector"] = _faults(bench, recordings, before_point, after_values, posterior)
    verdict["biased_outputs"] = _biased(verdict["fault_vector"])
    verdict["shrinks"] = shrinks(
        bench, held_out, verdict["fault_vector"], recordings, verdict["discovered"], reading.told
    )
    fitted = [
        {**p, "name": n.split(".", 1)[-1]}
        for entry in verdict["which"][:1]
        for n, p in entry.get("parameters", {}).items()
    ]
    before = _simulator(bench, before_point, ())
    found_any = fitted or reading.forms  # what is described changes the unit as well as an effect does
    verdict["simulator"] = {"before": before, "after": _simulator(bench, after_values, fitted) if found_any else before}
    if held_out is not None:
        verdict["held_out"] = {e: round(r, 3) for e, r in held_out.ratios.items()}
    verdict["next_experiment"] = []
    verdict["warnings"] = []
    return Diagnosed(verdict, bench, fit, reading, best, before_point, after_values, noise)


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


def _which(
    bench: Bench, machine: ReferenceActuator, reading: Reading, found: Sequence[Mapping], search: Search
) -> list[dict]:
    """Sets with their probabilities and parameters, the empty set and the unknown; the verdict's own first."""
    grouped = {e for g in reading.groups for e in g}
    entries: list[dict[str, Any]] = []
    for effects, p, model in reading.sets[:12]:
        inside = grouped & set(effects)
        entries.append(
            {
                "effects": list(effects), "probability": p, "group": "group 1" if inside and reading.groups else None,
                "parameters": _parameters(bench, machine, effects, search.wide(model)),
                "log_evidence_gain": float(model.log_likelihood - search.fit(()).log_likelihood),
            }
        )  # fmt: skip
    rest = sum(p for _, p, _ in reading.sets[12:])
    empty: dict[str, Any] = {"effects": [], "probability": reading.empty, "group": None}
    equation = _equation(reading, found)
    unknown: dict[str, Any] = {
        "effects": ["unknown"],
        "equation": equation,
        "probability": reading.unknown + rest,
        "group": None,
    }
    total = sum(e["probability"] for e in (*entries, empty, unknown))
    for e in (*entries, empty, unknown):
        e["probability"] = round(float(e["probability"]) / total, 6)
    if reading.verdict in ("no_gap", "described"):
        return [empty, *entries, unknown]
    if reading.verdict == "unknown":
        return [unknown, *entries, empty]
    named = set(reading.named)
    entries.sort(key=lambda e: (not named <= set(e["effects"]), -e["probability"]))
    return [*entries, empty, unknown]


def _equation(reading: Reading, found: Sequence[Mapping]) -> str:
    left = sorted((k for k in reading.inclusion if k.startswith("remainder:")), key=lambda k: -reading.inclusion[k])
    if left and reading.inclusion[left[0]] > 0.1:
        equation = left[0].split(":", 1)[1]
        return EQUATION.get(equation, equation)
    return str(found[0]["equation"]) if found else "electrical"


def _discovered(
    bench: Bench,
    machine: ReferenceActuator,
    reading: Reading,
    model: Model,
    fit: Fit,
    changes: Mapping[str, float],
) -> list[dict]:
    """Forms that no catalogue lists, and remainders, as the verdict tells them.

    ``changes``: by effect, log odds that it has another size in each recording.
    """
    out = []

    @cache
    def partly(but: tuple[str, ...]) -> Reduced:
        return bench.reduce(fit.normal, but) if but else fit.search.reduced

    described = {d.id: d for d in bench.described}
    for form in reading.forms:
        unit = next(u for u in bench.units if u.id == form)
        linear = {
            p.name: (bench.after({p.name: model.deviations[p.name]})[p.name], model.spread[p.name])
            for p in unit.parameters
            if p.name in model.deviations
        }
        if form in described:
            values = bench.point | {n: v for n, (v, _) in linear.items()}
            blocks = [b for r in bench.recordings for b in bench.machine.blocks(values, r, wanted=())]
            found = curve(bench.machine, described[form], blocks, bench.carried, values)
            entry = telling.told(described[form], linear, machine.actuator)
            entry["curve"] = telling.picture(described[form], found, machine.actuator)
            entry["term"] = carried.of_form(described[form], linear, list(bench.recordings), machine.actuator)
        else:
            units = {p.name: p.units for p in unit.parameters}
            entry = telling.told_of_chain(form, unit.equations[0], linear, units, machine.actuator)
            entry["term"] = carried.of_chain(form, linear)
        out.append(
            {
                "unit": form, "probability": float(reading.inclusion[form]), "closed": None,
                "another_form_of": another_form_of(partly, fit.search, form, model.deviations),
                "recordings": list(bench.recordings), **entry,
            }
        )  # fmt: skip
    for left in reading.remainders:
        equation = left.split(":", 1)[1]
        out.append(
            {
                "unit": left, "equation": EQUATION.get(equation, equation), "along": "time", "form": "remainder",
                "probability": float(reading.inclusion[left]), "closed": None,
                "another_form_of": another_form_of(partly, fit.search, left, model.deviations), "parameters": {},
                "recordings": list(bench.recordings),
                "sentence": remainder_sentence(fit.search, equation, changes),
            }
        )  # fmt: skip
    return out


def remainder_sentence(search: Search, equation: str, changes: Mapping[str, float]) -> str:
    """What an equation leaves, and what it looks like in each recording, were it of one size in all."""
    like = [
        TERMS[e].SENTENCE
        for e, odds in changes.items()
        if odds > 0.0 and equation.startswith(tuple(search.units[e].equations))
    ]
    said = f"The {equation.replace('_', ' ')} equation leaves more than noise, not described further."
    if like:
        said += f" In each recording by itself it looks as if {', or '.join(like)}, by another amount each time."
    return said


def _controller(bench: Bench, fit: Fit, reading: Reading, values: Mapping[str, float]) -> dict[str, dict]:
    """The controller's gains as fitted in the control equation."""
    index = fit.normal.index
    n = [x for x in bench.nuisances if x.startswith("controller.")]
    if "remainder:control" in reading.remainders:  # which may stand in for a gain
        n += [x for x in index if x.startswith("remainder.control.")]
    k = np.array([index[x] for x in n])
    prior = np.array([1.0 / bench.prior(x)[1] ** 2 for x in n])
    covariance = Definite(fit.normal.H[np.ix_(k, k)] + np.diag(prior)).solve(np.eye(len(k)))
    out = {}
    for name, units in CONTROLLER.items():
        full = f"controller.{name}"
        value, nominal = values[full], bench.parameters[full].off
        sd = float(np.hypot(np.sqrt(covariance[n.index(full), n.index(full)]), SAMPLED * abs(value)))
        out[name] = {"value": value, "low": value - Z * sd, "high": value + Z * sd, "units": units, "nominal": nominal}
    return out


def covariance_of(bench: Bench, normal: Normal, model: Model) -> tuple[dict[str, int], np.ndarray]:
    """Places of the nuisances and a model's own parameters, and the posterior covariance with all of them free."""
    names = [*bench.nuisances, *(n for n in model.deviations if is_parameter(n))]
    k = np.array([normal.index[n] for n in names])
    sd = np.array([bench.prior(n)[1] for n in names])
    A = normal.H[np.ix_(k, k)] * np.outer(sd, sd) + np.eye(len(k))
    return {n: k for k, n in enumerate(names)}, Definite(A).solve(np.eye(len(k))) * np.outer(sd, sd)


def _faults(
    bench: Bench, recordings, before: Mapping, after: Mapping, posterior: tuple[dict[str, int], np.ndarray]
) -> dict[str, dict]:
    out: dict[str, dict] = {}
    index, covariance = posterior
    for name in bench.recordings:
        rec = bench.machine.recordings[name]
        out[name] = {"before": {}, "after": {}}
        for component in FAULT_NAMES:
            shift = rec.dT_measured if component == "dT" else 0.0
            parts = [component if component != "dT" and rec.health == "unknown" else f"{component}@{name}"]
            if component != "dT" and rec.health == "seeded":
                parts.append(SEEDED + component)
            k = [index[n] for n in parts if n in index]
            sd = float(np.sqrt(covariance[np.ix_(k, k)].sum()))
            for stage, values in (("before", before), ("after", after)):
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
    return out
