"""Fault vectors of a diagnosed bench: the posterior of its diagnosis, with what that names and describes taken out."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from scipy.special import ndtri

from .. import schema
from ..errors import InputError, shown
from ..faults import FAULT_NAMES
from ..plain import read_json

LEVEL = 0.9  # of the intervals in a verdict


@dataclass(frozen=True)
class OfVerdict:
    """Estimates of recordings as ``identify_recordings`` gives them, and what was taken out, in words."""

    estimates: list[dict[str, dict[str, float]]]
    taken_out: list[str]


def of_verdict(path: str | Path, recordings: Sequence[Path], level: float = LEVEL) -> OfVerdict:
    """Fault vectors that a verdict has of recordings.

    Parameters
    ----------
    path : ``diagnosis.json`` of a bench of the actuator
    recordings : files of that bench

    Raises
    ------
    InputError : not such a verdict, or one of another bench
    """
    if not 0.0 < level < 1.0:
        raise InputError(f"--level: got {level}, accepted is above 0 and below 1")
    verdict = read_json(path, "bench", "fault_vector", "which", "discovered")
    try:
        vectors = verdict["fault_vector"]
        for file in recordings:
            if verdict["bench"] not in (file.resolve().parent.name, file.stem):
                raise InputError(f"is of the bench {shown(verdict['bench'])}, not of {shown(file)}")
            if file.name not in vectors:
                raise InputError(
                    f"{shown(file)} is none of its {len(vectors)} recordings; name those, or diagnose the bench anew, "
                    "with more --samples if it left some out"
                )
        wider = float(ndtri(0.5 + 0.5 * level) / ndtri(0.5 + 0.5 * LEVEL))
        estimates = [_estimate(vectors[f.name], f"fault_vector.{f.name}", wider) for f in recordings]
        named = [e.replace("_", " ") for e in verdict["which"][0]["effects"] if e != "unknown"]
        described = [str(d["sentence"]).rstrip(".") for d in verdict["discovered"] if d.get("form") != "remainder"]
    except InputError as error:
        raise InputError(f"{shown(path)}: {error}") from None
    except (KeyError, TypeError, IndexError, AttributeError) as error:
        raise InputError(f"{shown(path)}: is not the verdict of a bench of the actuator ({error!r})") from error
    return OfVerdict(estimates, [*named, *described])


def _estimate(vector, key: str, wider: float) -> dict[str, dict[str, float]]:
    out = {}
    for component in FAULT_NAMES:
        found = vector["after"][component]
        for word in ("value", "low", "high"):
            schema.check(found[word], float, f"{key}.after.{component}.{word}")
        value = found["value"]
        ends = {word: value + wider * (found[word] - value) for word in ("low", "high")}
        out[component] = {"value": value, **ends}
    return out
