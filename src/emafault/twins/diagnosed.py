"""Diagnosis of measured machines case by case, and the withheld check on them."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from emafault.gap.decide import Calibration
from emafault.gap.diagnose import INTERVAL, Diagnosis, diagnose
from emafault.gap.groups import GROUP_DISTANCE, confusability
from emafault.gap.held_out import claim, held_out
from emafault.gap.next_experiment import next_experiments
from emafault.gap.where import equation_of
from emafault.twins.library import bench, build_twin, distortions, read_cases
from emafault.twins.measured import Arrays, MeasuredTwin
from emafault.twins.reconstructed import reconstruct_measured

NAMED = ("explained", "group", "partly")
NEIGHBOUR = 0.95  # cosine of two signatures from which one effect stands in for the other


def diagnose_twin(twin: MeasuredTwin, calibration: Calibration) -> Diagnosis:
    """One case; the verdict gains ``held_out`` (what survives the confirm recordings) and ``notes``."""
    found = diagnose(twin, twin.case, twin.explore, twin.confirm, calibration)
    found.verdict["held_out"] = held_out(found)
    claim(found, found.verdict["held_out"])
    found.verdict["notes"] = list(twin.notes)
    return found


def diagnose_cases(
    name: str, path: Path, calibration: Calibration, nameplate: Mapping[str, float] | None = None
) -> dict[str, Diagnosis]:
    """Every case of a file, with the paper's R and k where its signals allow (``reconstructed``).

    Parameters
    ----------
    nameplate : case -> speed constant (1/min per V), for comparison only

    Raises
    ------
    InputError : a file or a case that the twin cannot use
    """
    found = {}
    for case, arrays in read_cases(name, path).items():
        twin = build_twin(name, case, arrays)
        found[case] = diagnose_twin(twin, calibration)
        found[case].verdict["next_experiment"] = next_experiments(found[case], bench(twin))
        features = reconstruct_measured(name, arrays, (nameplate or {}).get(case))
        found[case].verdict["reconstructed"] = [
            asdict(f) | {"bias": {reference: f.bias(reference) for reference in f.references}} for f in features
        ]
    return found


@dataclass(frozen=True)
class Withheld:
    """One row of the withheld check on measured data.

    ``expected`` are the effects of which one should be named, empty where the verdict should be unknown; ``placed`` is
    the equation with the largest misfit that the verdict leaves. ``right``: a distortion is named (and moves its
    parameter by five deviations, where the undistorted case names the effect too); what the library lacks is refused in
    the right equation, by ``unknown``, by a remainder beside effects that are there, or by the confirm recordings.
    ``unknown``: the verdict itself is that word.
    """

    twin: str
    case: str
    what: str
    expected: tuple[str, ...]
    equations: tuple[str, ...]
    verdict: str
    named: tuple[str, ...]
    outcome: str
    placed: str
    unknown: bool
    right: bool


def check_file(name: str, path: Path, calibration: Calibration) -> list[Withheld]:
    """Withheld check on a file.

    Known distortions are put on the case with the smallest gap of its own, so that what is named is theirs; the
    strongest effect is left out of the library where the gap is largest.
    """
    cases = read_cases(name, path)
    misfit = {}
    for case, arrays in cases.items():
        found = diagnose_twin(build_twin(name, case, arrays), calibration).found
        misfit[case] = found.null.misfit
    least, most = min(misfit, key=lambda c: misfit[c]), max(misfit, key=lambda c: misfit[c])
    rows = check_distortions(name, least, cases[least], calibration)
    return rows + check_left_out(name, most, cases[most], calibration)


def check_distortions(name: str, case: str, arrays: Arrays, calibration: Calibration) -> list[Withheld]:
    """Every known distortion of one case."""
    rows = []
    plain = diagnose_twin(build_twin(name, case, arrays), calibration)
    for distortion in distortions(name):
        found = diagnose_twin(build_twin(name, case, distortion.apply(arrays)), calibration)
        rows.append(
            _row(name, case, distortion.name, distortion.effects, (distortion.equation,), found, calibration, plain)
        )
    return rows


def check_left_out(name: str, case: str, arrays: Arrays, calibration: Calibration) -> list[Withheld]:
    """One case with its strongest effect, and what leaves the same trace, left out of the library."""
    rows = []
    twin = build_twin(name, case, arrays)
    whole = diagnose_twin(twin, calibration)
    singles = [c for c in whole.found.candidates if len(c.effects) == 1]
    if singles and whole.decision.verdict in NAMED:
        strongest = max(singles, key=lambda c: c.gain).effects[0]
        out = same_trace(whole, strongest)
        left = diagnose_twin(twin.without(*sorted(out)), calibration)
        equations = next(h.equations for h in twin.hypotheses if h.effect == strongest)
        rows.append(_row(name, case, f"left out: {', '.join(sorted(out))}", (), equations, left, calibration))
    return rows


def same_trace(whole: Diagnosis, effect: str) -> set[str]:
    """An effect with what leaves the same trace: where it is left out, a stand-in would be no wrong name.

    Such are effects with nearly its signature, and two that together leave what was fitted of it, so that these data
    cannot tell (one channel's gain is the other two's and the mean's).
    """
    problem, null, singles = whole.explore, whole.found.null, whole.found.singles
    cosines = confusability(problem, null, singles)
    out = {effect} | {e for pair, c in cosines.items() if effect in pair and c > NEIGHBOUR for e in pair}
    fitted = next((c for c in whole.found.candidates if c.effects == (effect,)), None)
    if fitted is None:
        return out
    trace = problem.whiten(fitted.point.prediction - null.prediction)
    open_trace = problem.projected(null, trace)
    whitened = {c.effects[0]: problem.whiten(c.signature) for c in singles if np.any(c.signature)}
    projected = {effect: problem.projected(null, signature) for effect, signature in whitened.items()}
    specified = [bool(problem.parameters[m].specified) for m in problem.nuisances]
    nuisances = (problem.whiten(null.jacobian) * problem.sd[list(problem.nuisances)])[:, specified]
    for pair in combinations(sorted(set(whitened) - out), 2):
        span, dual = (np.concatenate([of[e] for e in pair], axis=1) for of in (whitened, projected))
        left = open_trace - dual @ np.linalg.lstsq(span.T @ dual, dual.T @ trace, rcond=1e-9)[0]
        # what it takes of a nuisance that nothing specifies is its prior's saying, not the data's
        if np.square(left).sum() + np.square(nuisances.T @ left).sum() < GROUP_DISTANCE:
            out |= set(pair)
    return out


def _row(
    name: str,
    case: str,
    what: str,
    expected: tuple[str, ...],
    equations: tuple[str, ...],
    found: Diagnosis,
    calibration: Calibration,
    plain: Diagnosis | None = None,
) -> Withheld:
    verdict, outcome = found.decision.verdict, found.verdict["held_out"]["outcome"]
    named = {e for c in found.decision.group for e in c.effects} if verdict in NAMED else set()
    families = found.found.families
    remains = verdict in NAMED and families[0].excess > calibration.remainder
    placed = equation_of(families if remains else found.found.null_families)
    if expected:
        right = any(e in named and (plain is None or _moved(plain, found, e)) for e in expected)
    else:
        # beside effects that are truly there, what is unknown is the remainder
        refused = verdict == "unknown" or outcome == "contradicted" or remains
        right = refused and any(placed.startswith(e) or e.startswith(placed) for e in equations)
    return Withheld(
        name,
        case,
        what,
        expected,
        equations,
        verdict,
        tuple(sorted(named)),
        outcome,
        placed,
        verdict == "unknown",
        right,
    )


def _moved(plain: Diagnosis, found: Diagnosis, effect: str) -> bool:
    """Whether an effect's parameters differ from those of the undistorted case, if that names it too."""

    def fitted(diagnosis: Diagnosis) -> dict[str, dict]:
        inside = {e for c in diagnosis.decision.group for e in c.effects}
        entries = diagnosis.verdict["which"] if diagnosis.decision.verdict in NAMED and effect in inside else []
        named = [e["parameters"] for e in entries if effect in e["effects"] and "parameters" in e]
        return {k: v for k, v in (named[0] if named else {}).items() if v["effect"] == effect}

    before, after = fitted(plain), fitted(found)
    if not before:
        return True
    return any(
        abs(after[k]["value"] - v["value"]) > 5 * (after[k]["high"] - after[k]["low"]) / (2 * INTERVAL)
        for k, v in before.items()
        if k in after
    )
