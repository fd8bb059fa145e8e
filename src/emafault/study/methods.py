"""All methods by all experiments: errors beside the bound of the recordings and that of six features; coverage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..plain import read_json
from .bound import CALIBRATED

LOWEST = 3.0  # standard errors below a bound, or of a coverage, that are not chance
COVER = {0.9: (0.88, 0.92)}  # level of the intervals -> accepted coverage
SEVERAL = "several_recordings"
#: output -> digits that are shown of it
DIGITS = {"dT": 3, "N": 5, "xi": 5}


@dataclass(frozen=True)
class Row:
    """One method in one experiment; of errors the mean absolute ones by output, dT in K."""

    experiment: str
    method: str
    parameters: int  # trained weights
    runs: int
    errors: dict[str, float]
    recordings: dict[str, float] | None  # bound of the recordings; None where none holds
    six: dict[str, float] | None  # bound of six features
    coverage: float
    level: float

    @property
    def covers(self) -> bool:
        """Whether the coverage is accepted; of a level without a range of its own always."""
        low, high = COVER.get(self.level, (0.0, 1.0))
        return low <= round(self.coverage, 3) <= high

    @property
    def chance(self) -> float:
        """By how much the coverage of intervals that hold is off by chance at most, as if a run's components went
        together; intervals that were scored on few runs are off by more."""
        return LOWEST * float(np.sqrt(self.level * (1.0 - self.level) / self.runs))

    @property
    def below(self) -> list[str]:
        """Outputs whose error is below the bound of the recordings by more than chance."""
        if self.recordings is None:
            return []
        chance = np.sqrt((np.pi / 2.0 - 1.0) / self.runs)
        return [name for name in DIGITS if self.errors[name] / self.recordings[name] < 1.0 - LOWEST * chance]


def rows_of(results: Path, names: Sequence[str] = ()) -> list[Row]:
    """Rows of every evaluated experiment and variant in a folder of results, in the order of their names.

    Parameters
    ----------
    names : experiments, or variants ``experiment/variant``; none takes all there are

    Raises
    ------
    InputError : a name that was not evaluated, or a file that cannot be read
    """
    folder = results / "experiments"
    files = {
        path.parent.parent.relative_to(folder).as_posix(): path for path in folder.rglob("evaluation/metrics.json")
    }
    several = results / SEVERAL / "errors.json"
    known = sorted({*files, *(name.split("/")[0] for name in files), *([SEVERAL] if several.is_file() else [])})
    if not known:
        raise InputError(f"{results}: holds no evaluated experiment, snakemake makes one")
    for name in names:
        if name not in known:
            raise InputError(f"{name}: was not evaluated in {results}, accepted are {', '.join(known)}")
    wanted = {name for name in files if not names or name in names or name.split("/")[0] in names}
    rows = [row for name in sorted(wanted) for row in _of_metrics(name, files[name])]
    return rows + (_of_several(several) if several.is_file() and (not names or SEVERAL in names) else [])


def _of_metrics(experiment: str, path: Path) -> list[Row]:
    table = read_json(path, "results", "level", "bound")
    out = []
    for entry in table["results"]:
        for kind in ("", CALIBRATED):
            of = entry.get(f"all{kind}")
            if of is None:
                continue
            whole = "heating" if entry["bound"] == "heating" else "recording"
            out.append(
                Row(
                    experiment,
                    f"{entry['method']}, {entry['estimator']}{kind.replace('_', ', ')}".replace("_", " "),
                    int(entry["parameters"]),
                    int(of["rows"]["mean"]),
                    {name: of[f"errors.{name}.mae"]["mean"] for name in DIGITS},
                    table["bound"].get(whole + kind),
                    table["bound"].get("floating" + kind),
                    of["coverage.mean"]["mean"],
                    table["level"],
                )
            )
    return out


def _of_several(path: Path) -> list[Row]:
    entries = read_json(path)
    bounds = {(e["experiment"], e["features"], e["count"]): e["bound"] for e in entries}
    return [
        Row(
            f"{SEVERAL}/{e['experiment']}, {e['count']}",
            f"{e['features']} features, closed form together",
            0,
            e["count"] * e["units"],
            e["errors"],
            bounds[e["experiment"], "nine", e["count"]],
            bounds[e["experiment"], "six", e["count"]],
            e["coverage"],
            0.9,
        )
        for e in entries
    ]


def markdown(rows: Sequence[Row]) -> list[str]:
    """Lines of the table in Markdown, and behind it what is not as it should be."""
    lines = [
        "| experiment | method | weights | runs | dT (K), N, xi | over the recordings' bound | six features' | cover |",
        "|---|---|---|---|---|---|---|---|",
    ]
    before = None
    for row in rows:
        errors = ", ".join(f"{row.errors[name]:.{digits}f}" for name, digits in DIGITS.items())
        ratios = [_over(row.errors, bound) for bound in (row.recordings, row.six)]
        shown = f"`{row.experiment}`" if row.experiment != before else ""
        cells = [shown, row.method, str(row.parameters), str(row.runs), errors, *ratios, f"{row.coverage:.3f}"]
        lines.append(f"| {' | '.join(cells)} |")
        before = row.experiment
    held = [row for row in rows if row.covers]
    lines += ["", f"{len(held)} of {len(rows)} rows cover as they should"]
    for r in rows:
        if not r.covers:
            by = "by more than chance" if abs(r.coverage - r.level) > r.chance else "no more than by chance"
            lines.append(
                f"    {r.experiment}: {r.method} covers {r.coverage:.3f}, {by} ({r.chance:.3f}, {r.runs} runs)"
            )
    lines += [f"    {r.experiment}: {r.method} is below its bound in {', '.join(r.below)}" for r in rows if r.below]
    return lines


def _over(errors: Mapping[str, Any], bound: Mapping[str, float] | None) -> str:
    if bound is None:
        return "none holds"
    return ", ".join(f"{errors[name] / bound[name]:.2f}" for name in DIGITS)
