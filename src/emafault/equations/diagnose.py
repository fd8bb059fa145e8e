"""Diagnosis of a bench of the reference actuator by equation errors: from recordings to the verdict."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..diagnosis.closure import Ladder, closed
from ..diagnosis.fit import Bench, Fit, is_parameter
from ..diagnosis.naming import Reading, read
from ..diagnosis.search import Model
from ..diagnosis.where import where
from ..effects import EFFECTS
from ..errors import InputError
from ..faults import FAULT_NAMES
from ..recording import Recording
from .machine import FAULTS, ReferenceActuator
from .signals import Signals, estimated_noise
from .terms import TERMS

SCHEMA = "2.0"
Z = 1.645  # standard deviations of a 90 % interval
EQUATION = {"commutation": "control"}  # of a block -> of the verdict
CONTROLLER = {"position_gain": "1/s", "speed_gain": "A s/rad", "speed_integral_gain": "A/rad"}
FORM = {"~lag": "lag", "~crosstalk": "crosstalk", "~drift": "drift"}
TOLD = 3.0  # standard deviations from nominal at which a controller's gain is told as different
TELLING = 0.02  # of a gain: smaller differences are not worth telling


def diagnose(
    name: str,
    recordings: Mapping[str, Recording],
    split: tuple[Sequence[str], Sequence[str]],
    actuator: ActuatorParameters,
    noise: SensorNoise,
    exclude: Sequence[str] = (),
    processes: int = 1,
) -> dict[str, Any]:
    """The verdict on a bench, in the format of ``diagnosis.json``.

    Parameters
    ----------
    recordings : by name, read and checked
    split : names of those that explore and of those that confirm
    noise : of the sensors, where the recordings do not tell it
    exclude : effects that the library is to lack
    processes : in which recordings are linearised side by side

    Raises
    ------
    InputError : an effect that does not exist
    """
    for effect in exclude:
        if effect not in EFFECTS:
            raise InputError(f"exclude: '{effect}' is not an effect, accepted are {', '.join(EFFECTS)}")
    explore, confirm = split
    own = estimated_noise([recordings[n] for n in explore], noise)
    machine = ReferenceActuator(actuator, {n: Signals.of(n, recordings[n], actuator, own) for n in explore}, exclude)
    bench = Bench(machine, list(explore), processes)
    fit = bench.fit()
    reading = read(fit.models, fit.search.units.values(), tuple(machine.observed()))
    sealed = _seal(reading)
    if not confirm:
        return _verdict(name, split, machine, bench, fit, reading, sealed, None, recordings)
    # from here on the confirm recordings are open
    own = estimated_noise(list(recordings.values()), noise)
    whole = ReferenceActuator(actuator, {n: Signals.of(n, r, actuator, own) for n, r in recordings.items()}, exclude)
    every = Bench(whole, list(recordings), processes)
    begun = every.point | {n: v for n, v in bench.point.items() if n in every.point}
    every.point, every.on = begun, set(bench.on)
    all_fit = every.fit(warm=True)
    final = read(all_fit.models, all_fit.search.units.values(), tuple(whole.observed()))
    ladder = Ladder(whole, confirm, every.parameters, all_fit.weights)
    return _verdict(name, split, whole, every, all_fit, final, sealed, (ladder, bench, fit), recordings)


def _seal(reading: Reading) -> dict[str, Any]:
    """What the explored recordings say, with a digest that anyone can recompute."""
    out: dict[str, Any] = {
        "verdict": reading.verdict,
        "which": [{"effects": list(s), "probability": round(p, 5)} for s, p, _ in reading.sets[:8]],
        "discovered": list(reading.forms),
    }
    text = json.dumps(out, sort_keys=True, separators=(",", ":"))
    return out | {"digest": hashlib.sha256(text.encode()).hexdigest()}


def _verdict(
    name, split, machine, bench: Bench, fit: Fit, reading: Reading, sealed, held_out, recordings
) -> dict[str, Any]:
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
    verdict["which"] = _which(bench, machine, reading, found)
    listed = [u.id for u in bench.units if u.kind in ("structural", "calibration")]
    verdict["inclusion"] = {e: round(float(reading.inclusion.get(e, 0.0)), 5) for e in (*listed, *machine.observed())}
    verdict["discovered"] = _discovered(bench, reading, best)
    verdict["controller"] = _controller(bench, fit)
    verdict["groups"] = [list(g) for g in reading.groups]
    before_point = _null_point(bench)
    spreads = _spreads(bench, fit, best)
    after_values = _values(bench, fit, best)
    verdict["fault_vector"] = _faults(bench, recordings, before_point, after_values, spreads)
    verdict["biased_outputs"] = _biased(verdict["fault_vector"])
    verdict["shrinks"] = _shrinks(bench, held_out, best, before_point, recordings, verdict)
    verdict["next_experiment"] = []
    verdict["warnings"] = []
    return verdict


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


def _which(bench: Bench, machine: ReferenceActuator, reading: Reading, found: Sequence[Mapping]) -> list[dict]:
    """Sets with their probabilities and parameters, the empty set and the unknown; the verdict's own first."""
    grouped = {e for g in reading.groups for e in g}
    entries: list[dict[str, Any]] = []
    for effects, p, model in reading.sets[:12]:
        inside = grouped & set(effects)
        entries.append(
            {
                "effects": list(effects), "probability": p, "group": "group 1" if inside and reading.groups else None,
                "parameters": _parameters(bench, machine, effects, model),
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


def _discovered(bench: Bench, reading: Reading, model: Model) -> list[dict]:
    """Forms that no catalogue lists, and remainders, as the verdict tells them."""
    out = []
    for form in reading.forms:
        kind = next(v for k, v in FORM.items() if form.startswith(k))
        unit = next(u for u in bench.units if u.id == form)
        parameters = {}
        for n in model.deviations:
            if any(n == p.name for p in unit.parameters):
                p = bench.parameters[n]
                value = bench.after({n: model.deviations[n]})[n]
                sd = model.spread[n]
                parameters[n] = {"value": value, "low": value - Z * sd, "high": value + Z * sd, "units": p.units}
        channel = form.split("_", 1)[1].replace("_", " of phase ")
        out.append(
            {
                "equation": unit.equations[0], "along": "time", "form": kind,
                "probability": float(reading.inclusion[form]),
                "closed": None, "another_form_of": None, "parameters": parameters, "recordings": list(bench.recordings),
                "sentence": f"In the measuring chain: {kind} of the {channel} channel.",
            }
        )  # fmt: skip
    for left in reading.remainders:
        equation = left.split(":", 1)[1]
        out.append(
            {
                "equation": EQUATION.get(equation, equation), "along": "time", "form": "remainder",
                "probability": float(reading.inclusion[left]), "closed": None, "another_form_of": None,
                "parameters": {},
                "recordings": list(bench.recordings),
                "sentence": f"The {equation.replace('_', ' ')} equation leaves more than noise, not described further.",
            }
        )  # fmt: skip
    return out


def _controller(bench: Bench, fit: Fit) -> dict[str, dict]:
    """The controller's gains as fitted in the control equation."""
    index = fit.normal.index
    n = [x for x in bench.nuisances if x.startswith("controller.") and "@" not in x]
    k = np.array([index[x] for x in n])
    prior = np.array([1.0 / bench.parameters[x].sd ** 2 for x in n])
    covariance = np.linalg.inv(fit.normal.H[np.ix_(k, k)] + np.diag(prior))
    out = {}
    for name, units in CONTROLLER.items():
        full = f"controller.{name}"
        sd = float(np.sqrt(covariance[n.index(full), n.index(full)]))
        value, nominal = bench.point[full], bench.parameters[full].off
        out[name] = {"value": value, "low": value - Z * sd, "high": value + Z * sd, "units": units, "nominal": nominal}
    return out


def _null_point(bench: Bench) -> dict[str, float]:
    """The recalibrated nominal model: the nuisances alone, on the same recordings."""
    null = Bench(bench.machine, bench.recordings, bench.processes)
    null.weights = bench.weights
    for _ in range(2):
        normal = null.normal(null.linearise())
        null.move(Model((), 0.0, 0.0, {}, {}), normal)
    return null.values()


def _values(bench: Bench, fit: Fit, model: Model) -> dict[str, float]:
    """All values at a model's fit, the nuisances with it."""
    kept = dict(bench.point), set(bench.on)
    bench.move(model, fit.normal)
    out = bench.values()
    bench.point, bench.on = kept
    return out


def _spreads(bench: Bench, fit: Fit, model: Model) -> dict[str, float]:
    """Posterior standard deviations of the nuisances with a model's own parameters free."""
    names = [*bench.nuisances, *(n for n in model.deviations if is_parameter(n))]
    k = np.array([fit.normal.index[n] for n in names])
    sd = np.array([bench.prior(n)[1] for n in names])
    A = fit.normal.H[np.ix_(k, k)] * np.outer(sd, sd) + np.eye(len(k))
    return dict(zip(names, (np.sqrt(np.diag(np.linalg.inv(A))) * sd).tolist(), strict=True))


def _faults(bench: Bench, recordings, before: Mapping, after: Mapping, spreads: Mapping) -> dict[str, dict]:
    out: dict[str, dict] = {}
    for name in bench.recordings:
        rec = bench.machine.recordings[name]
        out[name] = {"before": {}, "after": {}}
        for component in FAULT_NAMES:
            if component == "dT":
                full, shift = f"dT@{name}", rec.dT_measured
            else:
                full, shift = (component if rec.health == "unknown" else f"{component}@{name}"), 0.0
            sd = float(spreads.get(full, 0.0))
            for stage, values in (("before", before), ("after", after)):
                value = float(values[full]) + shift
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


def _shrinks(bench: Bench, held_out, best: Model, before: Mapping, recordings, verdict) -> dict[str, Any]:
    """The ladder on the confirm recordings."""
    if held_out is None:
        return {"signal": None, "features": None, "fault_vector": None}
    ladder, explored, fit = held_out
    reading = read(fit.models, fit.search.units.values())
    model = reading.sets[0][2] if reading.named else fit.models[0]
    frozen_null = {**{n: p.off for n, p in bench.parameters.items()}, **_null_point(explored)}
    frozen_after = {**frozen_null, **_values(explored, fit, model)}
    nominal = {n: p.off for n, p in bench.parameters.items()}
    for n in frozen_null:
        if n in FAULTS or n.split("@")[0] in FAULTS:
            nominal[n] = frozen_null[n]
    rungs = {}
    for rung, values in (("nominal", nominal), ("recalibrated", frozen_null), ("after", frozen_after)):
        whites, _ = ladder.blocks(values)
        rungs[rung] = (*ladder.rung(whites), whites)
    recalibrated, rows, whites = rungs["recalibrated"]
    after = rungs["after"][0]
    size = sum(is_parameter(n) for n in model.deviations)
    signal = {
        "nominal": rungs["nominal"][0], "recalibrated": recalibrated, "placebo": ladder.placebo(whites, size),
        "after": after, "floor": 1.0, "closed": closed(recalibrated, after, 1.0, rows),
    }  # fmt: skip
    return {"signal": signal, "features": None, "fault_vector": None}
