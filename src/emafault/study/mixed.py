"""Mixed cases: one listed effect beside what no catalogue lists, and a controller with other gains.

Each bench of the generator is diagnosed plain and disturbed. The generator knows nothing of the diagnosis.
"""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..equations.diagnose import diagnose
from ..gap.bench import read_bench, split_bench
from ..progress import say
from ..recording import replace_atomically
from ..withheld.benches import write_bench
from ..withheld.cases import Case, draw_case
from ..withheld.disturbances import DISTURBANCES, OUTSIDE, disturbed, draw_controller

NAMED = 0.9
FIRST_SEED = 2_000_000  # above every other draw's
STRONG = 0.1  # smallest amplitude, as a share of the realistic maximum: what nobody could see is not in question here


def run_mixed(spec: Mapping[str, Any], output: Path) -> dict[str, Any]:
    """Draw, disturb and diagnose ``spec['cases']`` benches; write what was named to ``output``."""
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    cases: list[dict[str, Any]] = []
    seed = FIRST_SEED + int(spec["first"])
    names = list(DISTURBANCES)
    while len(cases) < int(spec["cases"]):
        seed += 1
        case = draw_case("T1", seed)
        if (case.amplitude or 1.0) < STRONG or "control_delay" in case.effects:
            continue
        disturbance = [*names, "controller"][len(cases) % (len(names) + 1)]
        entry = _one(case, disturbance, actuator, noise)
        cases.append(entry)
        say(
            f"{case.name} {disturbance}: {'named' if entry['named'] else 'lost'}, beside it {entry['beside'] or 'none'}"
        )
    result = {"cases": cases, "summary": summary(cases)}
    replace_atomically(output, lambda temporary: temporary.write_text(json.dumps(result, indent=1)))
    return result


def _one(case: Case, disturbance: str, actuator: ActuatorParameters, noise: SensorNoise) -> dict[str, Any]:
    with TemporaryDirectory() as folder:
        plain, other = Path(folder) / "plain", Path(folder) / "other"
        write_bench(case, plain, actuator, noise)
        recordings = read_bench(plain, actuator).recordings
        before = _named(recordings, actuator, noise)
        if disturbance == "controller":
            factors = draw_controller(case.seed)
            changed = replace(actuator, **{n: getattr(actuator, n) * f for n, f in factors.items()})
            write_bench(case, other, changed, noise)
            recordings = read_bench(other, actuator).recordings
        else:
            recordings = disturbed(recordings, disturbance, case.seed)
        after = _named(recordings, actuator, noise)
    truth = set(case.effects)
    return {
        "case": case.name, "effects": sorted(truth), "disturbance": disturbance, "outside": disturbance in OUTSIDE,
        "named": truth <= set(after["named"]), "beside": sorted(set(after["named"]) - truth),
        "named_without": truth <= set(before["named"]), "beside_without": sorted(set(before["named"]) - truth),
        "discovered": after["discovered"], "verdict": after["verdict"],
    }  # fmt: skip


def _named(recordings, actuator: ActuatorParameters, noise: SensorNoise) -> dict[str, Any]:
    verdict = diagnose("bench", recordings, split_bench(recordings), actuator, noise).verdict
    named = [e for e, p in verdict["inclusion"].items() if p >= NAMED]
    return {"named": named, "discovered": [d["form"] for d in verdict["discovered"]], "verdict": verdict["verdict"]}


def summary(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Shares over all cases and per disturbance, with 90 % bootstrap intervals by bench."""
    out = {"all": _shares(cases)}
    for name in dict.fromkeys(c["disturbance"] for c in cases):
        out[name] = _shares([c for c in cases if c["disturbance"] == name])
    return out


def _shares(cases: list[dict[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {"cases": len(cases)}
    rng = np.random.default_rng(1)
    for name, values in (
        ("named", [c["named"] for c in cases]),
        ("another_beside", [bool(c["beside"]) for c in cases]),
        ("named_without", [c["named_without"] for c in cases]),
        ("another_beside_without", [bool(c["beside_without"]) for c in cases]),
    ):
        x = np.array(values, float)
        draws = x[rng.integers(len(x), size=(2000, len(x)))].mean(axis=1)
        found[name] = {
            "value": float(x.mean()),
            "low": float(np.quantile(draws, 0.05)),
            "high": float(np.quantile(draws, 0.95)),
        }
    return found
