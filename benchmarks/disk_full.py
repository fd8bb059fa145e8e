"""The disk full at ten random moments of a small study: one clear line each, and nothing that was made is lost.

    python benchmarks/disk_full.py [--times 10] [--seed 0]

Results are on a file system in memory (tmpfs; needs root), which is made larger after each time that it is full, and
the study goes on. At the end it is compared with one that had room. Prints a line for each time.
"""

import argparse
import random
import re
import subprocess
import tempfile
from pathlib import Path

from house import SMALL, build, environment, snakemake
from kills import of_the_study, plain

ROOM = 400  # MB, more than the study takes


def results(house: Path) -> dict[str, bytes]:
    """What the study made, without times."""
    files = sorted(p for p in (house / "results").rglob("*") if p.is_file() and of_the_study(p))
    return {str(p.relative_to(house)): plain(p) for p in files}


def study(house: Path) -> subprocess.CompletedProcess:
    """Run the study, one job at a time, so that one is hit."""
    return subprocess.run(
        snakemake(*SMALL, cores="1"), cwd=house, env=environment(house), capture_output=True, text=True
    )


def mount(folder: Path, megabytes: float, again: bool = True) -> None:
    """Give a folder so much room."""
    options = f"{'remount,' if again else ''}size={int(megabytes * 1024)}k"
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)], check=True)


def size(folder: Path) -> float:
    """What a folder takes (MB)."""
    return sum(p.stat().st_blocks * 512 for p in folder.rglob("*") if p.is_file()) / 2**20


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        house = build(Path(name) / "roomy")
        done = study(house)
        assert done.returncode == 0, done.stderr[-3000:]
        expected, needed = results(house), size(house / "results")
        tight = build(Path(name) / "tight")
        (tight / "results").mkdir()
        rng = random.Random(args.seed)
        sizes = sorted(rng.uniform(0.02, 0.98) * needed for _ in range(args.times))
        mount(tight / "results", sizes[0], again=False)
        try:
            fill(tight, sizes, expected)
        finally:
            subprocess.run(["umount", str(tight / "results")], check=True)


def fill(house: Path, sizes: list[float], expected: dict[str, bytes]) -> None:
    """Run the study in ever more room, the last time in enough."""
    before: dict[str, bytes] = {}
    for megabytes in sizes:
        mount(house / "results", megabytes)
        ran = study(house)
        said = {line for line in ran.stderr.splitlines() if line.startswith("emafault: ")}
        assert "Traceback" not in ran.stderr, ran.stderr[-3000:]
        if ran.returncode == 0:
            print(f"{megabytes:.1f} MB: enough", flush=True)
            continue
        assert len(said) == 1 and re.search("No space left|disk is full", next(iter(said))), ran.stderr[-3000:]
        kept = results(house)
        lost = [n for n in before if kept.get(n) != before[n]]
        assert not lost, f"lost: {lost}"
        parts = list((house / "results").rglob("*.part"))
        assert not parts, f"left over: {parts}"
        print(f"{megabytes:.1f} MB, {len(kept)} results kept: {next(iter(said))}", flush=True)
        before = kept
    mount(house / "results", ROOM)
    ran = study(house)
    assert ran.returncode == 0, ran.stderr[-3000:]
    got = results(house)
    different = [n for n in expected | got if expected.get(n) != got.get(n)]
    assert not different, f"differ: {different}"
    print(f"with room: {len(got)} results, the same bits as of a study that always had it")


if __name__ == "__main__":
    main()
