"""The withheld check on measured machines: changes put in by hand, and the strongest effect left out of the library."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from ..diagnosis.closure import rms
from .diagnose import Diagnosed, diagnose
from .held_out import whitened
from .library import Stated, build, read_cases
from .statement import Arrays, told
from .verdict import Z

NEIGHBOUR = 0.95  # cosine of two signatures from which one effect stands in for the other
WITHIN = 6.0  # squared distance that no data tell apart
MOVED = 5.0  # standard deviations by which a distortion moves what the undistorted case has too


@dataclass(frozen=True)
class Withheld:
    """One row of the check.

    ``kind``: ``put in``, a change of the raw arrays whose cause is known; ``left out``, where the truth is what the
    diagnosis itself named before. ``expected`` are the effects of which one should be named, empty where the verdict
    should leave a remainder in one of ``equations``. ``beside``: names that neither the change nor the undistorted case
    accounts for.
    """

    kind: str
    twin: str
    case: str
    what: str
    expected: tuple[str, ...]
    equations: tuple[str, ...]
    verdict: str
    named: tuple[str, ...]
    beside: tuple[str, ...]
    outcome: str
    placed: tuple[str, ...]
    right: bool


def check_file(machine: Stated, path: Path) -> list[Withheld]:
    """Changes are put on the case with the smallest gap; an effect is left out where the gap is largest."""
    cases = read_cases(machine, path)
    found = {case: diagnose(build(machine, case, arrays), False) for case, arrays in cases.items()}
    gap = {
        case: rms(whitened(d.explored.recorded, d.machine.explore, _general(d.explored.base())))
        for case, d in found.items()
    }
    least, most = min(gap, key=lambda c: gap[c]), max(gap, key=lambda c: gap[c])
    return check_distortions(machine, least, cases[least], found[least]) + check_left_out(
        machine, most, cases[most], found[most]
    )


def check_distortions(machine: Stated, case: str, arrays: Arrays, plain: Diagnosed) -> list[Withheld]:
    """Every known change of one case."""
    out = []
    for change in machine.distortions:
        found = diagnose(build(machine, case, change.apply(arrays)), False)
        named = names_of(found.verdict)
        placed = placed_in(found.verdict)
        if change.effects:
            right = any(e in named and _moved(plain.verdict, found.verdict, e) for e in change.effects)
        else:
            right = _refused(found.verdict, placed, (change.equation,))
        beside = set(named) - set(names_of(plain.verdict)) - set(change.effects)
        out.append(
            Withheld(
                "put in", machine.name, case, change.name, change.effects, (change.equation,),
                found.verdict["verdict"], named, tuple(sorted(beside)), found.verdict["held_out"]["outcome"], placed,
                right,
            )
        )  # fmt: skip
    return out


def check_left_out(machine: Stated, case: str, arrays: Arrays, plain: Diagnosed) -> list[Withheld]:
    """One case with its strongest effect, and what leaves the same trace, left out of the library."""
    named = names_of(plain.verdict)
    listed = {u.id for u in plain.whole.bench.units}
    singles = [m for m in plain.whole.fit.search.ranked() if len(m.units) == 1 and m.units[0] in listed & set(named)]
    if not singles:
        return []
    strongest = max(singles, key=lambda m: m.log_likelihood).units[0]
    out = same_trace(plain, strongest)
    found = diagnose(build(machine, case, arrays).without(*sorted(out)), False)
    equations = acts_in(plain, strongest)
    placed = placed_in(found.verdict)
    now = names_of(found.verdict)
    return [
        Withheld(
            "left out", machine.name, case, ", ".join(sorted(out)), (), equations, found.verdict["verdict"], now,
            tuple(sorted(set(now) - set(named))), found.verdict["held_out"]["outcome"], placed,
            _refused(found.verdict, placed, equations),
        )
    ]  # fmt: skip


def acts_in(plain: Diagnosed, effect: str) -> tuple[str, ...]:
    """Equations in whose rows an effect shows."""
    unit = next(u for u in plain.whole.bench.units if u.id == effect)
    names = {p.name for p in unit.parameters}
    base = plain.whole.base()
    found = [b for n in plain.whole.bench.recordings for b in plain.whole.recorded.blocks(base, n, wanted=names)]
    return tuple(sorted({told(b.equation) for b in found if b.columns}))


def same_trace(plain: Diagnosed, effect: str) -> set[str]:
    """An effect with what leaves the same trace: where it is left out, a stand-in would be no wrong name.

    Such are effects that take up nearly all of what was fitted of it, and two that together leave less of it than any
    data tell apart (one channel's gain is the other two's and the mean's).
    """
    null = plain.whole.null
    reduced = plain.whole.null.reduce(plain.whole.at_base)
    columns = {
        u.id: [reduced.index[p.name] for v in null.active(u) for p in v.parameters if p.name in reduced.index]
        for u in null.units
    }
    mine = columns.pop(effect)
    d = np.linalg.lstsq(reduced.M[np.ix_(mine, mine)] + 1e-12 * np.eye(len(mine)), reduced.b[mine], rcond=1e-9)[0]
    power = float(d @ reduced.M[np.ix_(mine, mine)] @ d)

    def left(others: tuple[str, ...]) -> float:
        k = [i for o in others for i in columns[o]]
        b = reduced.M[np.ix_(k, mine)] @ d
        return power - float(b @ np.linalg.lstsq(reduced.M[np.ix_(k, k)], b, rcond=1e-9)[0])

    near = {e for e in columns if columns[e] and left((e,)) < (1.0 - NEIGHBOUR**2) * power}
    rest = sorted(e for e in columns if columns[e] and e not in near)
    pairs = {e for pair in combinations(rest, 2) if left(pair) < WITHIN for e in pair}
    return {effect} | near | pairs


def names_of(verdict: Mapping[str, Any]) -> tuple[str, ...]:
    """Effects named, alone or as one of a group."""
    if verdict["verdict"] not in ("explained", "group", "partly"):
        return ()
    sure = {e for e, p in verdict["inclusion"].items() if p >= 0.9}
    return tuple(sorted(sure | {e for g in verdict["groups"] for e in g}))


def placed_in(verdict: Mapping[str, Any]) -> tuple[str, ...]:
    """Equations in which the verdict leaves something unknown."""
    placed = {d["equation"] for d in verdict["discovered"]}
    if verdict["verdict"] == "unknown":
        placed.add(verdict["which"][0]["equation"])
    return tuple(sorted(placed))


def _refused(verdict: Mapping[str, Any], placed: tuple[str, ...], equations: tuple[str, ...]) -> bool:
    refused = verdict["verdict"] == "unknown" or bool(placed)
    return refused and any(p.startswith(told(e)) or told(e).startswith(p) for p in placed for e in equations)


def _moved(plain: Mapping[str, Any], found: Mapping[str, Any], effect: str) -> bool:
    """Whether an effect's parameters differ from those of the undistorted case, if that names it too."""

    def parameters(verdict: Mapping[str, Any]) -> dict[str, Any]:
        entries = (e["parameters"] for e in verdict["which"] if effect in e["effects"] and "parameters" in e)
        return {k: p for k, p in next(entries, {}).items() if p["effect"] == effect}

    before, after = parameters(plain), parameters(found)
    if effect not in names_of(plain) or not before:
        return True
    return any(
        abs(after[k]["value"] - p["value"]) > MOVED * (after[k]["high"] - after[k]["low"]) / (2 * Z)
        for k, p in before.items()
        if k in after
    )


def _general(values: Mapping[str, float]) -> dict[str, float]:
    return {n: 0.0 if "@" in n else v for n, v in values.items()}
