"""From a posterior over sets to names: one rule, an inclusion probability of at least ``NAMED``.

Effects whose inclusions reach it only together, one standing in for the other in the sets, are a group; a form that
reaches it only together with the undescribed remainder of its equation is told, if it is the likelier.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.special import expit

from .model import LISTED, SETTINGS, Unit, meet
from .search import Search
from .sets import Model, posterior

NAMED = 0.9
PRESENT = 0.5  # of a remainder, from which it is more likely there than not
#: what the controller does with what it sees is no gap of the machine
OWN_BUSINESS = ("remainder:control",)
MEMBERS = 4  # largest group
MOST = 12  # sets told
POSSIBLE = 0.1  # inclusion from which a listed effect, or something undescribed, is told as possible


@dataclass(frozen=True)
class Reading:
    """What a posterior says: names, groups, forms, equations with a remainder, and the masses they rest on."""

    named: tuple[str, ...]
    groups: tuple[tuple[str, ...], ...]
    forms: tuple[str, ...]
    remainders: tuple[str, ...]
    inclusion: Mapping[str, float]
    sets: Sequence[tuple[tuple[str, ...], float, Model]]  # listed effects of a set, its mass, its leading model
    empty: float  # mass of sets without listed effect that leave nothing undescribed
    unknown: float  # mass of the other sets without listed effect: with a remainder, or a form that is not told
    places: Mapping[str, float]  # by equation, the mass of the sets with a remainder of it, or a form that is not told
    verdict: str

    @property
    def left(self) -> tuple[str, ...]:
        """Remainders that the verdict tells: those of the sets, and those of what is there in one form or another."""
        return _present(self.places)

    @property
    def told(self) -> frozenset[str]:
        """Units that the verdict tells."""
        return frozenset((*self.named, *(e for g in self.groups for e in g), *self.forms, *self.left))


def read(
    models: Sequence[Model],
    units: Iterable[Unit],
    observed: Sequence[str] = (),
    one_equation: bool = True,
    counted: bool = False,
    wandering: Mapping[str, float] = MappingProxyType({}),
) -> Reading:
    """Read a posterior; effects ``observed`` for certain belong to every set.

    ``one_equation``: whether only effects that act in a common equation may be a group; ``counted``: whether the
    recordings show faults of their measuring chain without a model; ``wandering``: by equation, log odds that what is
    left in it wanders, which is a remainder of it that no column shows where no listed effect acts.
    """
    units = list(units)
    kind = {**{f"remainder:{e}": "remainder" for e in wandering}, **{u.id: u.kind for u in units}}
    weights = [float(w) for w in posterior(models)]
    acts = {u.id: u.equations for u in units}
    wanders = {e: float(expit(odds)) for e, odds in wandering.items()}
    listed_of = [tuple(sorted({*observed, *(u for u in m.units if kind.get(u) in LISTED)})) for m in models]
    wandering_of = _wandering(models, listed_of, acts, wanders)
    inclusion: dict[str, float] = {e: 1.0 for e in observed}
    for model, w, may in zip(models, weights, wandering_of, strict=True):
        for u in model.units:
            inclusion[u] = inclusion.get(u, 0.0) + w
        for u, p in may.items():
            inclusion[u] = inclusion.get(u, 0.0) + w * p
    inclusion = {u: min(p, 1.0) for u, p in inclusion.items()}  # sums of masses, but for rounding
    named = tuple(sorted(e for e, p in inclusion.items() if p >= NAMED and kind.get(e, "structural") in LISTED))
    open_ = [e for e in inclusion if kind.get(e) in LISTED and e not in named]
    groups = _groups(models, weights, open_, inclusion, {u.id: u.equations if one_equation else ("",) for u in units})
    alike = _same(units)
    inclusion |= {e: p for same in alike for e, p in _either(models, weights, same).items()}
    present = [e for e, p in inclusion.items() if p >= PRESENT and kind.get(e) == "form"]
    forms = tuple(sorted(e for e in present if max(inclusion[e], _or_left(models, weights, e, acts[e])) >= NAMED))
    of_controller = {u.id for u in units if u.of_controller}
    # a form that is not told is no explanation, and no sign that there is nothing
    known = {e for same in alike if same & set(forms) for e in same} | set(forms)
    undescribed = {u.id for u in units if u.kind == "form"} - known - of_controller
    remainders = tuple(sorted(e for e, p in inclusion.items() if p >= PRESENT and e.startswith("remainder:")))
    left_over = undescribed | {u for u in inclusion if _is_left(u, kind)}
    places = _places(models, weights, {u: acts[u][0] for u in undescribed}, wandering_of)
    left = [not left_over.isdisjoint(m.units) for m in models]
    steady = [float(np.prod([1.0 - p for p in may.values()])) for may in wandering_of]
    mass = _masses(models, weights, listed_of, np.where(left, 0.0, steady), acts)
    of_machine = set(forms) - of_controller
    beside = bool(counted or of_machine or set(_present(places)).difference(OWN_BUSINESS))
    if named or groups:
        verdict = "partly" if beside else "group" if groups else "explained"
    elif of_machine or (counted and mass.nothing >= 0.5):
        verdict = "described"
    else:
        verdict = "no_gap" if mass.nothing >= 0.5 else "unknown"
    return Reading(named, groups, forms, remainders, inclusion, mass.sets, mass.empty, mass.unknown, places, verdict)


@dataclass(frozen=True)
class _Masses:
    """Posterior mass by the listed effects of the sets, as a ``Reading`` has it; ``nothing``: that of no gap."""

    sets: Sequence[tuple[tuple[str, ...], float, Model]]
    empty: float
    unknown: float
    nothing: float


def _masses(
    models: Sequence[Model],
    weights: Sequence[float],
    listed_of: Sequence[tuple[str, ...]],
    sure: np.ndarray,
    acts: Mapping[str, Sequence[str]],
) -> _Masses:
    """``listed_of``, ``sure``: of each model the listed effects, and the probability that it leaves nothing
    undescribed; ``acts``: equations of the units."""
    masses: dict[tuple[str, ...], float] = {}
    leading: dict[tuple[str, ...], Model] = {}
    empty = unknown = settings = 0.0
    for model, w, listed, of_it in zip(models, weights, listed_of, sure.tolist(), strict=True):
        if not listed:
            empty += w * of_it
            unknown += w * (1.0 - of_it)
            continue
        masses[listed] = masses.get(listed, 0.0) + w
        leading.setdefault(listed, model)
        if all(set(acts.get(u, ("",))) <= set(SETTINGS) for u in listed):
            settings += w * of_it
    sets = sorted(((s, p, leading[s]) for s, p in masses.items()), key=lambda x: -x[1])
    # what is the controller's alone is no gap of the machine
    return _Masses(sets, empty, unknown, max(0.0, empty + settings))


def _present(places: Mapping[str, float]) -> tuple[str, ...]:
    """Remainders of the equations where something undescribed is more likely there than not."""
    return tuple(sorted(f"remainder:{e}" for e, p in places.items() if p >= PRESENT))


def _same(units: Iterable[Unit]) -> list[set[str]]:
    """Forms that differ from each other by what is free beside them, of each the others too."""
    out: dict[str, set[str]] = {}
    for u in units:
        if u.same_as:
            out.setdefault(u.same_as, {u.same_as}).add(u.id)
    return list(out.values())


def _either(models: Sequence[Model], weights: Sequence[float], same: set[str]) -> dict[str, float]:
    """Mass of the sets that have any of several forms, as the inclusion of the one that the likeliest of them has."""
    having = [(w, same & set(m.units)) for m, w in zip(models, weights, strict=True)]
    most = max(((w, sorted(own)[0]) for w, own in having if own), default=None)
    return {} if most is None else {most[1]: min(sum(w for w, own in having if own), 1.0)}


def _places(
    models: Sequence[Model],
    weights: Sequence[float],
    undescribed: Mapping[str, str],
    wandering_of: Sequence[Mapping[str, float]],
) -> dict[str, float]:
    """By equation, the mass of the sets that leave something undescribed in it: a remainder, one that wanders, or, in
    its first equation, a form that is not told."""
    out: dict[str, float] = {}
    for m, w, wandering in zip(models, weights, wandering_of, strict=True):
        left = {u for u in m.units if u.startswith("remainder:")} | {
            f"remainder:{undescribed[u]}" for u in m.units if u in undescribed
        }
        for u in left | set(wandering):
            e = u.removeprefix("remainder:")
            out[e] = out.get(e, 0.0) + w * (1.0 if u in left else wandering[u])
    return {e: min(p, 1.0) for e, p in out.items()}


def _is_left(unit: str, kind: Mapping[str, str]) -> bool:
    """Whether a unit is a remainder that is not the controller's own business."""
    return kind.get(unit, "remainder") == "remainder" and unit not in OWN_BUSINESS


def _wandering(
    models: Sequence[Model],
    listed_of: Sequence[tuple[str, ...]],
    acts: Mapping[str, Sequence[str]],
    wanders: Mapping[str, float],
) -> list[dict[str, float]]:
    """Of each set the remainders that it does not have, with the probabilities that what it leaves wanders so; beside a
    listed effect that may be the effect's own form."""
    free = {
        listed: {
            f"remainder:{e}": p for e, p in wanders.items() if not any(meet(acts.get(u, ()), (e,)) for u in listed)
        }
        for listed in dict.fromkeys(listed_of)
    }  # fmt: skip
    return [
        {r: p for r, p in free[listed].items() if r not in m.units}
        for m, listed in zip(models, listed_of, strict=True)
    ]  # fmt: skip


def _or_left(models: Sequence[Model], weights: Iterable[float], form: str, equations: Sequence[str]) -> float:
    """Mass of the sets that have a form, or a remainder where it acts, which could be it."""

    def has(units: Sequence[str]) -> bool:
        left = [u.split(":", 1)[1] for u in units if u.startswith("remainder:")]
        return form in units or any(meet(equations, (e,)) for e in left)

    return sum(float(w) for m, w in zip(models, weights, strict=True) if has(m.units))


def _groups(models, weights, effects, inclusion, equations) -> tuple[tuple[str, ...], ...]:
    """Smallest sets of effects of which exactly one is included with probability ``NAMED`` or more.

    Only effects that act in a common equation can be taken for one another.
    """
    likely = sorted((e for e in effects if inclusion[e] >= 0.02), key=lambda e: -inclusion[e])[:8]
    units = [set(m.units) for m in models]
    out: list[tuple[str, ...]] = []
    used: set[str] = set()
    for size in range(2, MEMBERS + 1):
        for group in combinations(likely, size):
            if not all(meet(equations[a], equations[b]) for a, b in combinations(group, 2)):
                continue
            if used & set(group) or (inclusion[group[0]] > 0.0 and sum(inclusion[e] for e in group) < NAMED):
                continue
            one = sum(float(w) for u, w in zip(units, weights, strict=True) if len(u & set(group)) == 1)
            if one >= NAMED and min(inclusion[e] for e in group) >= 0.02:
                out.append(tuple(sorted(group)))
                used |= set(group)
    return tuple(out)


def told_sets(
    reading: Reading, search: Search, parameters: Callable[[Sequence[str], Model], dict[str, dict]], equation: str
) -> list[dict[str, Any]]:
    """Sets as a verdict tells them, with the empty set and the unknown, their probabilities adding up to one; the
    verdict's own first.

    Parameters
    ----------
    parameters : of the effects of a set, from its model with the widths of their priors
    equation : where what is unknown lies
    """
    grouped = {e for g in reading.groups for e in g}
    entries: list[dict[str, Any]] = [
        {
            "effects": list(effects), "probability": p, "group": "group 1" if grouped & set(effects) else None,
            "parameters": parameters(effects, search.wide(model)),
            "log_evidence_gain": float(model.log_likelihood - search.fit(()).log_likelihood),
        }
        for effects, p, model in reading.sets[:MOST]
    ]  # fmt: skip
    rest = sum(p for _, p, _ in reading.sets[MOST:])
    empty: dict[str, Any] = {"effects": [], "probability": reading.empty, "group": None}
    unknown: dict[str, Any] = {
        "effects": ["unknown"], "equation": equation, "probability": reading.unknown + rest, "group": None,
    }  # fmt: skip
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


def possible_place(reading: Reading) -> str | None:
    """Equation where something undescribed is the likeliest, if it is possible at all."""
    likeliest = min(reading.places, key=lambda e: (-reading.places[e], e), default=None)
    return None if likeliest is None or reading.places[likeliest] <= POSSIBLE else likeliest
