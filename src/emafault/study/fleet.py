"""A fleet: every bench of a folder diagnosed, one row a bench in a Parquet table, in batches that resume."""

import hashlib
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..effects import EFFECTS
from ..equations.diagnose import diagnose
from ..errors import InputError, one_line
from ..faults import FAULT_NAMES
from ..io.atomic import replace_atomically, write_text
from ..io.bench import Bench, read_bench
from ..io.enough import within
from ..io.split import split_bench
from ..plain import read_json
from ..progress import progress
from ..reporting.written import to_json

NAMED = 0.9  # inclusion probability from which an effect is named
LEVEL = 0.9  # of the intervals of a verdict's fault vector
_DEVIATIONS = NormalDist().inv_cdf(0.5 + 0.5 * LEVEL)
COMPONENTS = FAULT_NAMES[:5]  # dT is of a recording, not of a unit
FAILURES = (ArithmeticError, LookupError, ValueError, np.linalg.LinAlgError)  # InputError is a ValueError


def diagnose_batch(
    benches: Sequence[str], spec: Mapping[str, Any], kept: Path, output: str | Path, exclude: Sequence[str] = ()
) -> None:
    """Diagnose benches and write their rows.

    A bench that cannot be diagnosed is a row that says why. What a killed job had diagnosed is not done again: a row is
    kept by the content of its recordings.

    Parameters
    ----------
    benches : folders of recordings
    spec : ``actuator`` and ``sensors`` of a composed configuration
    kept : folder for one row a bench, of this version of the code and of this configuration
    output : Parquet file of the batch

    Raises
    ------
    InputError : a file that cannot be written
    """
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    rows = []
    for bench in progress(benches, f"fleet {Path(output).stem}", len(benches)):
        path = kept / f"{Path(bench).name}.{_digest(bench)}.json"
        if not path.exists():
            write_text(path, to_json(row_of(bench, actuator, noise, exclude)))
        rows.append(read_json(path, "bench", "verdict"))
    write_table(rows, output)


def _digest(bench: str | Path) -> str:
    """Digest of the names and bytes of a bench's files."""
    digest = hashlib.sha256()
    for path in sorted(Path(bench).glob("*.nc")):
        digest.update(path.name.encode() + b"\0")
        with open(path, "rb") as file:
            digest.update(hashlib.file_digest(file, "sha256").digest())
    return digest.hexdigest()[:16]


def row_of(
    bench: str | Path, actuator: ActuatorParameters, noise: SensorNoise, exclude: Sequence[str] = ()
) -> dict[str, Any]:
    """What is kept of the diagnosis of one bench."""
    name, start = Path(bench).name, time.monotonic()
    row: dict[str, Any] = {"bench": name, "unit": name, "recorded": "", "recordings": 0}
    try:
        read = read_bench(bench, actuator)
        row |= _told_by_owner(read)
        taken = within(read).recordings
        verdict = diagnose(read.name, taken, split_bench(taken), actuator, noise, exclude).verdict
    except FAILURES as error:
        return row | {"verdict": "refused", "reason": one_line(error)[:300], "seconds": time.monotonic() - start}
    return row | _told_by_verdict(verdict) | {"seconds": time.monotonic() - start}


def _told_by_owner(bench: Bench) -> dict[str, Any]:
    """Unit and time of recording as the recordings say; a bench whose unit is not known is one of its own."""
    units = {r.attributes.get("unit", "") for r in bench.recordings.values()} - {"", "unknown"}
    times = sorted(r.attributes.get("recorded", "") for r in bench.recordings.values())
    return {"unit": next(iter(units), bench.name), "recorded": times[-1], "recordings": len(bench.recordings)}


def _told_by_verdict(verdict: Mapping[str, Any]) -> dict[str, Any]:
    signal = verdict["shrinks"]["signal"] or {}
    inclusion = verdict["inclusion"]
    row = {
        "verdict": verdict["verdict"],
        "reason": "",
        "named": sorted(effect for effect, p in inclusion.items() if p >= NAMED),
        "gap": max((entry["z"] for entry in verdict["where"]), default=0.0),
        "closed": signal.get("closed"),
        "described": [entry["sentence"] for entry in verdict["discovered"]],
        "digest": verdict["digest"],
    }
    row |= {f"p_{effect}": inclusion.get(effect, 0.0) for effect in EFFECTS}
    for name in COMPONENTS:
        found = [f["after"][name] for f in verdict["fault_vector"].values() if name in f["after"]]
        row[name] = float(np.median([x["value"] for x in found])) if found else None
        widths = [x["high"] - x["low"] for x in found]  # recordings share the unit's deviations: no better together
        row[f"{name}_sd"] = float(np.median(widths)) / (2.0 * _DEVIATIONS) if found else None
    return row


def _schema():
    import pyarrow as pa

    fields = [(name, pa.string()) for name in ("bench", "unit", "recorded", "verdict", "reason", "digest")]
    fields += [("recordings", pa.int64())]
    fields += [(name, pa.list_(pa.string())) for name in ("named", "described")]
    fields += [(name, pa.float64()) for name in ("gap", "closed", "seconds")]
    fields += [(f"p_{effect}", pa.float64()) for effect in EFFECTS]
    fields += [(f"{name}{suffix}", pa.float64()) for name in COMPONENTS for suffix in ("", "_sd")]
    return pa.schema(fields)


def write_table(rows: Sequence[Mapping[str, Any]], path: str | Path) -> None:
    """Write rows as Parquet, whole or not at all.

    Raises
    ------
    InputError : the file cannot be written
    """
    import pyarrow as pa
    from pyarrow import parquet

    table = pa.Table.from_pylist([dict(row) for row in rows], schema=_schema())
    replace_atomically(Path(path), lambda temporary: parquet.write_table(table, temporary))


def join_batches(batches: Iterable[str | Path], path: str | Path) -> None:
    """Write the tables of all batches as one, batch by batch.

    Raises
    ------
    InputError : a batch that cannot be read, or a file that cannot be written
    """
    from pyarrow import parquet

    def write(temporary: Path) -> None:
        with parquet.ParquetWriter(temporary, _schema()) as writer:
            for batch in batches:
                writer.write_table(parquet.read_table(batch, schema=_schema()))

    replace_atomically(Path(path), write)


def read_table(path: str | Path) -> list[dict[str, Any]]:
    """Rows of a table.

    Raises
    ------
    InputError : not such a table
    """
    import pyarrow as pa
    from pyarrow import parquet

    try:
        return parquet.read_table(path, schema=_schema()).to_pylist()
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path}: not a readable table of a fleet ({one_line(error)[:200]})") from error
