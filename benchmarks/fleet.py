"""A fleet of many small benches, diagnosed for real by the workflow.

    python benchmarks/fleet.py [--benches 1000] [--cores 2] [--folder DIR]

Units within their tolerances are recorded at five dates, two recordings of 0.4 s each time. From a date on a third of
them has an effect of the catalogue at the upper half of its range. The table is compared with what was put in.
"""

import argparse
import contextlib
import resource
import subprocess
import tempfile
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from emafault import config
from emafault.dataset import simulate_recording
from emafault.io.recording import write_recording
from house import build, environment, snakemake

DATES = [f"2026-{month:02d}-01" for month in (1, 3, 5, 7, 9)]
EFFECTS = {
    "contact_resistance": "effects.contact_resistance.R_x_a={:.4g}", "cogging": "effects.cogging.a={:.4g}",
    "stribeck": "effects.stribeck.a={:.4g}", "bus_resistance": "effects.bus_resistance.R={:.4g}",
    "speed_scale": "effects.speed_scale.scale={:.4g}",
}  # fmt: skip
UPPER = {
    "contact_resistance": (0.03, 0.05), "cogging": (0.006, 0.012), "stribeck": (0.015, 0.03),
    "bus_resistance": (0.3, 0.5), "speed_scale": (1.006, 1.01),
}  # fmt: skip
COMMANDS = ("reversal", "sine")
AMBIENT = (10.0, 30.0)  # degC
WITH_EFFECT = 1.0 / 3.0  # of the units


def make(folder: Path, benches: int) -> dict[str, str]:
    """Write the benches; by name the effect that each has, if any."""
    rng = np.random.default_rng(0)
    truth: dict[str, str] = {}
    for unit in range(-(-benches // len(DATES))):
        effect = str(rng.choice([*EFFECTS])) if rng.uniform() < WITH_EFFECT else ""
        begins = int(rng.integers(1, len(DATES)))
        size = rng.uniform(*UPPER[effect]) if effect else 0.0
        composed = {}
        for n, (date, command) in enumerate((d, c) for d in DATES for c in COMMANDS):
            on = bool(effect) and DATES.index(date) >= begins
            if (command, on) not in composed:
                of_effect = [EFFECTS[effect].format(size)] if on else []
                changes = [f"command={command}", "recording.duration=0.4", "unit=tolerance", *of_effect]
                composed[command, on] = config.dataset_spec(config.compose("paper", changes), "fresh")
            name = f"unit{unit:03d}_{date}"
            if name not in truth and len(truth) == benches:
                return truth
            truth[name] = effect if on else ""
            path = folder / name / f"{command}.nc"
            if path.exists():
                continue
            spec = composed[command, on] | {"seed": 100 * unit + n, "unit_seed": unit + 1}
            recording = simulate_recording(spec, np.array([0, 0, 0, 0, 0, AMBIENT[n % 2] - 20.0]))
            attributes = recording.attributes | {"unit": f"unit{unit:03d}", "recorded": date}
            write_recording(path, replace(recording, attributes=attributes))
    return truth


def main() -> None:
    """Make the fleet, diagnose it, print what it took and what is right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--benches", type=int, default=1000)
    parser.add_argument("--cores", default="2")
    parser.add_argument("--page", type=Path, help="where the fleet's page is kept")
    parser.add_argument("--folder", type=Path, help="where all is kept; a run that was cut off goes on there")
    args = parser.parse_args()
    with contextlib.nullcontext(args.folder) if args.folder else tempfile.TemporaryDirectory() as scratch:
        house, folder = Path(scratch).resolve() / "house", Path(scratch).resolve() / "benches"
        if not house.exists():
            build(house)
        truth = make(folder, args.benches)
        command = snakemake("fleet", "--config", f"benches={folder}", cores=args.cores)
        begun = time.monotonic()
        ran = subprocess.run(command, cwd=house, env=environment(house), capture_output=True, text=True)
        assert ran.returncode == 0, (ran.stdout + ran.stderr)[-4000:]
        took, used = time.monotonic() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
        report(house / "results" / "fleets" / folder.name, truth)
        cpu = used.ru_utime + used.ru_stime
        print(f"{len(truth)} benches; this run took {took:.0f} s, {cpu:.0f} s of CPU, ", end="")
        print(f"{used.ru_maxrss / 1024.0:.0f} MB the largest process")
        if args.page:
            args.page.write_bytes((house / "results" / "fleets" / folder.name / "report.html").read_bytes())


def report(fleet: Path, truth: dict[str, str]) -> None:
    """Print how the table's names compare with what was put in."""
    from emafault.study.fleet import read_table

    rows = {row["bench"]: row for row in read_table(fleet / "fleet.parquet")}
    with_effect = [n for n, effect in truth.items() if effect]
    without = [n for n, effect in truth.items() if not effect]
    right = sum(rows[n]["named"] == [truth[n]] for n in with_effect)
    wrong = sum(bool(set(rows[n]["named"]) - {truth[n]}) for n in truth)
    quiet = sum(not rows[n]["named"] for n in without)
    refused = sum(row["verdict"] == "refused" for row in rows.values())
    print(
        f"with an effect {len(with_effect)}, it alone named {right}; without {len(without)}, none named {quiet}; ",
        end="",
    )
    said = Counter(rows[n]["verdict"] for n in without)
    print(f"another name in {wrong}; refused {refused}; said of those without: {dict(said)}")


if __name__ == "__main__":
    main()
