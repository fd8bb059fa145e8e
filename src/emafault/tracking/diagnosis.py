"""A diagnosis as an MLflow run."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..provenance import digest_of, file_digest
from . import Data, Entry

#: rungs of the ladder of each kind of misfit that runs are compared by; the others stand in a table
COMPARED = {
    "signal": ("closed", "nominal", "recalibrated", "placebo", "after"),
    "features": ("closed", "after"),
    "fault_vector": ("closed", "after"),
}


def entry_of(
    verdict: Mapping[str, Any], sentences: Sequence[str], source: Path, files: Mapping[str, str | Path]
) -> Entry:
    """The run of a verdict.

    Parameters
    ----------
    sentences : what was found
    source : file or folder of the recordings
    files : as of ``Entry``
    """
    first = verdict["which"][0]
    rungs = {kind: rung for kind, rung in verdict["shrinks"].items() if rung}
    metrics = {"probability": first["probability"]} | {
        f"{kind}.{name}": rung[name]
        for kind, rung in rungs.items()
        for name in COMPARED.get(kind, ())
        if rung.get(name) is not None
    }
    recordings = [*verdict["recordings"]["explore"], *verdict["recordings"]["confirm"]]
    paths = sorted(source.glob("*.nc")) if source.is_dir() else [source]
    digest = digest_of(*([path.name, file_digest(path)] for path in paths))
    return Entry(
        verdict["bench"],
        parameters={
            "verdict": verdict["verdict"],
            "effects": "+".join(first["effects"]) or "no_gap",
            "twin": verdict["twin"],
            "recordings": verdict["recordings"],
            "digest": verdict["digest"],
        },
        metrics=metrics,
        tables=_tables(verdict, rungs),
        tags={"stage": "diagnosis", "bench": verdict["bench"]},
        note="\n".join(f"- {sentence}" for sentence in sentences),
        data=[Data(verdict["bench"], digest, str(source), "diagnosis", len(recordings))],
        files=files,
    )


def _tables(verdict: Mapping[str, Any], rungs: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, list]]:
    fitted = [
        {"cause": "+".join(entry["effects"]), "probability": entry["probability"], "parameter": name, **p}
        for entry in verdict["which"]
        for name, p in (entry.get("parameters") or {}).items()
    ]
    fitted += [
        {"cause": d["form"], "probability": d["probability"], "parameter": name, **p}
        for d in verdict["discovered"]
        for name, p in d["parameters"].items()
    ]
    gap = [
        {"misfit": kind, "rung": name, "value": value} for kind, rung in rungs.items() for name, value in rung.items()
    ]
    columns = ("cause", "parameter", "value", "low", "high", "units", "probability")
    tables = {
        "tables/gap.json": {c: [row[c] for row in gap] for c in ("misfit", "rung", "value")},
        "tables/parameters.json": {c: [row.get(c) for row in fitted] for c in columns},
    }
    return {name: table for name, table in tables.items() if next(iter(table.values()))}
