"""Where time and memory of the workflow went: what Snakemake measured of every job, by rule."""

import csv
from collections import defaultdict
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from ..errors import InputError
from .page import Page

PAGE = "report.html"


def write(folder: str | Path) -> None:
    """Write the page of a folder of Snakemake's benchmarks; where there are none, or it cannot be written, nothing."""
    jobs = read(Path(folder))
    if not jobs:
        return
    page = Page("Where time and memory went")
    page.paragraph("The last run of every job whose results are here; memory is the largest of a job.", "small")
    page.heading("By rule")
    by_rule = defaultdict(list)
    for name, job in jobs.items():
        by_rule[_rule(name)].append(job)
    page.table(HEADER, [_row(f"{rule} ({len(some)})", some) for rule, some in _longest(by_rule)])
    page.heading("The longest jobs")
    page.table(HEADER, [_row(name, some) for name, some in _longest({n: [job] for n, job in jobs.items()})[:20]])
    with suppress(InputError):  # said by what could not be written before
        page.write(Path(folder) / PAGE)


HEADER = ("rule (jobs)", "elapsed (s)", "processor (s)", "memory (MB)", "read (MB)", "written (MB)")


def read(folder: Path) -> dict[str, dict[str, float]]:
    """Name of a job -> what was measured: ``s``, ``cpu_time`` (s), ``max_rss``, ``io_in``, ``io_out`` (MB)."""
    found = {}
    for path in sorted(folder.rglob("*.tsv")):
        with suppress(OSError, ValueError, StopIteration):
            with open(path, newline="") as file:
                line = next(csv.DictReader(file, delimiter="\t"))
            found[str(path.relative_to(folder).with_suffix(""))] = {k: _number(line.get(k)) for k in _KEPT}
    return found


_KEPT = ("s", "cpu_time", "max_rss", "io_in", "io_out")


def _number(text: str | None) -> float:
    """What Snakemake writes of a job that was too short to be looked at counts as nothing."""
    return float(text) if text not in (None, "", "-", "NA") else 0.0


def _rule(name: str) -> str:
    """``paper/train_weighted_network`` is of the rules that train: the verb, which names of jobs begin with."""
    return name.rsplit("/", 1)[-1].split("_")[0]


def _longest(groups: Mapping[str, list[dict[str, float]]]) -> list[tuple[str, list[dict[str, float]]]]:
    return sorted(groups.items(), key=lambda item: -sum(job["s"] for job in item[1]))


def _row(name: str, jobs: list[dict[str, float]]) -> list[str]:
    total = {key: sum(job[key] for job in jobs) for key in _KEPT}
    memory = max(job["max_rss"] for job in jobs)
    return [
        name,
        *(f"{x:.1f}" for x in (total["s"], total["cpu_time"])),
        *(f"{x:.0f}" for x in (memory, total["io_in"], total["io_out"])),
    ]
