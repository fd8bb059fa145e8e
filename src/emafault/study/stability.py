"""Whether a diagnosis says the same again: of a bench recorded once more, and of the same unit in other recordings."""

import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..effects import EFFECTS
from ..withheld.benches import write_bench
from ..withheld.cases import Case, draw_case, in_other_noise, in_other_recordings
from ..withheld.verdicts import listed_names
from .blind import diagnose_bench

SURE, NOT = 0.9, 0.1  # inclusion probabilities


@dataclass(frozen=True)
class Stability:
    """What one case says of itself.

    ``verdicts``: word, and what is named and described, of each repetition; ``same``: the share of these that the
    commonest has; ``sure``: effects with an inclusion above ``SURE`` in one of the two sets of recordings, ``denied``:
    those of them below ``NOT`` in the other.
    """

    verdicts: tuple[str, ...]
    same: float
    sure: tuple[str, ...]
    denied: tuple[str, ...]


def stability(
    rung: str, seed: int, actuator: ActuatorParameters, noise: SensorNoise, repetitions: int = 20
) -> Stability:
    """Diagnose a case in ``repetitions`` draws of the noise, and once more in other recordings of the unit.

    What is described in the control equation, the controller's own business, is left out of the comparison.
    """
    case = draw_case(rung, seed)
    found = [_verdict(in_other_noise(case, n), actuator, noise) for n in range(repetitions)]
    said = tuple(_said(v) for v in found)
    other = _verdict(in_other_recordings(case, repetitions), actuator, noise)
    sure, denied = replicated(found[0]["inclusion"], other["inclusion"])
    return Stability(said, Counter(said).most_common(1)[0][1] / len(said), sure, denied)


def replicated(one: Mapping[str, float], other: Mapping[str, float]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Effects that one of two sets of recordings is sure of, and of these those that the other denies."""
    pairs = {e: (one.get(e, 0.0), other.get(e, 0.0)) for e in EFFECTS}
    sure = tuple(e for e, p in pairs.items() if max(p) > SURE)
    return sure, tuple(e for e in sure if min(pairs[e]) < NOT)


def _verdict(case: Case, actuator: ActuatorParameters, noise: SensorNoise) -> dict[str, Any]:
    with tempfile.TemporaryDirectory() as folder:
        bench = Path(folder) / "bench"
        write_bench(case, bench, actuator, noise)
        return diagnose_bench(bench, actuator, noise)


def _said(verdict: Mapping[str, Any]) -> str:
    described: Sequence[Mapping] = [d for d in verdict["discovered"] if d["equation"] != "control"]
    forms = sorted({f"~{d['form']} in {d['equation']}" for d in described})
    return f"{verdict['verdict']}: {', '.join([*sorted(listed_names(verdict)), *forms]) or '-'}"
