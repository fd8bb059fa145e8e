"""Calibration of the second curve for measured machines, on redrawn ones whose truth is known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from ..gap.decide import UNCALIBRATED, Calibration, Evidence
from ..gap.diagnose import Diagnosis
from ..twins.diagnosed import NAMED, diagnose_twin, same_trace
from ..twins.library import SHARED, measured_twins
from ..twins.redrawn import redraw
from .curves import DETECTABLE, fit_right
from .measured import write_json


@dataclass(frozen=True)
class Redrawing:
    """One diagnosis of a redrawn machine: its evidence, and whether the best set, or one of its group, is right."""

    evidence: Evidence
    right: bool


def calibrate_measured(listed: Path, folder: Path, check: Path, draws: int, seed: int) -> None:
    """Fit second curves to redrawn machines of ``data/measured/sets.yaml``, and check them on a disjoint draw.

    One for all twins together and, about it, one for each.

    Parameters
    ----------
    folder : where the calibrations go, ``shared.json`` and one of each twin's name
    check : written; how many of the disjoint draw's machines the prior and the fitted curves believe
    draws : redrawn machines of each twin, each diagnosed with its effect in the library and without
    seed : of the draw; that of the check is the next

    Raises
    ------
    InputError : a file that is not what its twin needs
    """
    start = Calibration.load(UNCALIBRATED)
    usable = machines(listed, start)
    drawn = {name: redrawings(name, found, draws, seed) for name, found in usable.items()}
    shared = fit([case for cases in drawn.values() for case in cases], start)
    own = {name: fit(cases, shared) for name, cases in drawn.items()}
    fresh = {name: redrawings(name, found, draws, seed + 1) for name, found in usable.items()}
    told = {
        name: {"prior": counts(cases, start), "shared": counts(cases, shared), "own": counts(cases, own[name])}
        for name, cases in fresh.items()
    }
    write_json(check, told)
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name, calibration in {SHARED: shared, **own}.items():
        calibration.save(Path(folder) / f"{name}.json")


def machines(listed: Path, calibration: Calibration) -> dict[str, list[Diagnosis]]:
    """The machines of each twin that can be redrawn: what they leave is known, for they have a cause or no gap."""
    of: dict[str, list[Diagnosis]] = {}
    for entry in yaml.safe_load(Path(listed).read_text()):
        for file in entry["files"]:
            path = Path(listed).parent / entry["folder"] / file
            found = [diagnose_twin(twin, calibration) for twin in measured_twins(entry["twin"], path).values()]
            usable = [d for d in found if d.ladder is not None and d.decision.verdict in (*NAMED, "no_gap")]
            of.setdefault(entry["twin"], []).extend(usable)
    return of


def redrawings(name: str, machines: Sequence[Diagnosis], draws: int, seed: int) -> list[Redrawing]:
    """Diagnoses of a twin's redrawn machines, two of each draw; what shows no candidate has nothing to tell."""
    rng, prior = np.random.default_rng([seed, *name.encode()]), Calibration.load(UNCALIBRATED)
    out = []
    for _ in range(draws if machines else 0):
        drawn = redraw(machines[int(rng.integers(len(machines)))], rng, DETECTABLE)
        if drawn is None:
            continue
        whole = diagnose_twin(drawn.twin, prior)
        alike = same_trace(whole, drawn.effect)
        left = diagnose_twin(drawn.twin.without(*sorted(alike)), prior)
        for known, found in ((alike, whole), (set[str](), left)):
            if found.found.candidates:
                sets = found.decision.group or found.found.candidates[:1]
                out.append(Redrawing(found.decision.evidence, any(known & set(c.effects) for c in sets)))
    return out


def fit(cases: Sequence[Redrawing], start: Calibration) -> Calibration:
    """A calibration with its second curve fitted to cases in which the first one sees a gap; as it is without any."""
    seen = [c for c in cases if float(np.dot(start.gap, c.evidence.gap_features())) > 0.0]
    if not seen:
        return start
    rows = np.array([c.evidence.right_features() for c in seen])
    right, most = fit_right(rows, np.array([c.right for c in seen]), start)
    source = f"{len(seen)} diagnoses of redrawn machines for the second curve, the prior for the first"
    return replace(start, right=right, most=most, source=source)


def counts(cases: Sequence[Redrawing], calibration: Calibration) -> Mapping[str, int]:
    """How many redrawn machines the second curve believes and does not, by what they are."""
    out = {"right, believed": 0, "right, not": 0, "wrong, believed": 0, "wrong, not": 0}
    for c in cases:
        believed = float(np.dot(calibration.right, c.evidence.right_features())) > 0.0
        out[f"{'right' if c.right else 'wrong'}, {'believed' if believed else 'not'}"] += 1
    return out
