"""The fitted numbers of a diagnosis of the reference actuator, with their posterior correlation."""

from dataclasses import replace

import numpy as np

from ..diagnosis.point import is_parameter
from ..effects import EFFECTS
from ..reporting.numbers import Number, Numbers, as_told
from .diagnose import Diagnosed
from .telling import subject
from .verdict import covariance_of
from .words import of_form, of_number


def numbers(found: Diagnosed) -> Numbers:
    """Every nuisance and parameter of the leading set; what lies beyond a tolerance is added to its quantity."""
    bench, model = found.bench, found.leading
    index, covariance = covariance_of(bench, found.fit.normal, model)
    own = [n for n in model.deviations if is_parameter(n) and bench.parameters[n].secant is None]
    beyond: dict[str, list[str]] = {}
    for n in own:
        alias = bench.parameters[n].alias
        if alias is not None:
            beyond.setdefault(alias, []).append(n)
    names = [*(n for n in own if bench.parameters[n].alias is None), *bench.nuisances]
    described = {d.id: d for d in bench.described}
    out, mix = [], np.zeros((len(names), len(index)))
    for row, n in enumerate(names):
        p = bench.parameters[n]
        words, units, factor = of_number(n), _units(n, p.units), 1.0
        if n.startswith("form."):
            form = described[n.split(".")[1]]
            what, units, factor = subject(form, bench.machine.actuator)
            words = of_form(form, what, n)
        mix[row, [index[k] for k in (n, *beyond.get(n, ())) if k in index]] = factor
        sd = float(np.sqrt(mix[row] @ covariance @ mix[row]))
        kind = "effect" if n in own or n in beyond else _kind(n)
        start, value, prior = (factor * x for x in (p.off, found.values[n], bench.prior(n)[1]))
        one = Number(_key(n), kind, start, value, sd, abs(prior), units, words)
        out.append(_of_logarithm(one) if ": log_" in one.name else one)
    whole = mix @ covariance @ mix.T
    width = np.sqrt(np.maximum(np.diag(whole), 1e-300))
    listed = [u for u in model.units if u in EFFECTS]
    return as_told(Numbers(out, whole / np.outer(width, width)), found.verdict, listed)


def _units(name: str, units: str) -> str:
    group, _, short = name.partition(".")
    listed = EFFECTS[group].parameters if group in EFFECTS else {}
    known = listed.get(short.removeprefix("log_").partition("@")[0])
    return known.units if known else units


def _of_logarithm(n: Number) -> Number:
    """The number itself, where its logarithm was fitted."""
    value = float(np.exp(n.value))
    return replace(
        n, name=n.name.replace("log_", ""), start=float(np.exp(n.start)), value=value, sd=value * n.sd,
        prior=value * n.prior,
    )  # fmt: skip


def _kind(name: str) -> str:
    return "recording" if "@" in name else "controller" if name.startswith("controller.") else "unit"


def _key(name: str) -> str:
    """What ``as_told`` finds a number of the verdict by."""
    name, _, recording = name.partition("@")
    group, _, short = name.rpartition(".")
    words = f"{group.replace('_', ' ')}: {short}" if group else short
    return f"{words}, {recording.removesuffix('.nc')}" if recording else words
