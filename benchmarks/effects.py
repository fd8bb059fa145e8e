"""How much the catalogue's effect terms slow a nominal run: the kernel beside itself with every effect written out.

    python benchmarks/effects.py [--repeats N]

The sources of the kernel are read, every effect's field is replaced by its nominal value as a literal, and what comes
out is compiled with the same options; the compiler then drops the terms. Both simulate the same run in turns.
"""

import argparse
import re
import sys
import time
from pathlib import Path

import numba
import numpy as np

import emafault.actuator.kernel as kernel
from emafault.actuator.commands import command_positions
from emafault.actuator.conduction import LANES
from emafault.actuator.parameters import make_runs
from emafault.actuator.state import RUN_STATE
from emafault.actuator.unlisted import no_terms
from emafault.compiled import OPTIONS
from emafault.config import reference_actuator
from emafault.effects import EFFECTS

LIMIT = 1.2
ROUNDING = 1e-13  # differences above this would be another physics


def specialised() -> tuple[dict, int]:
    """Names of the kernel compiled without effects, and how many fields were replaced."""
    folder = Path(kernel.__file__).parent
    modules = ("motor", "friction", "conduction", "grammar", "unlisted", "state", "instants", "lane", "kernel")
    source = "\n".join((folder / f"{name}.py").read_text() for name in modules)
    source = re.sub(r"^from \.[^\n(]*(\([^)]*\))?", "", source, flags=re.MULTILINE)
    replaced = 0
    for effect in EFFECTS.values():
        for name, parameter in effect.parameters.items():
            source, count = re.subn(rf"\bp\.{effect.field(name)}\b", repr(float(parameter.nominal)), source)
            replaced += count
    names: dict = {"compiled": numba.njit(**OPTIONS), "__name__": "without_effects"}
    names["compiled_inline"] = numba.njit(forceinline=True, **OPTIONS)
    exec(compile(source, "without_effects", "exec"), names)
    return names, replaced


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=60)
    repeats = parser.parse_args().repeats
    actuator, interval, records = reference_actuator(), 2e-4, 5000
    runs = make_runs(actuator, np.zeros((LANES, 6)))
    command = command_positions("parabolic", {"acceleration": 0.3}, 1.0, actuator.control_period)[None]
    names, replaced = specialised()
    engines = [kernel.run_batch, names["run_batch"]]
    shape = LANES, records
    outs = [[np.zeros((*shape, 3)) for _ in range(3)] + [np.zeros(shape) for _ in range(4)] for _ in engines]
    state = np.zeros(LANES, RUN_STATE)
    timing = np.full(LANES, interval), np.full(LANES, records)
    unlisted = no_terms()[None], np.zeros(2)
    best = [np.inf, np.inf]
    for n in range(repeats + 1):
        for e, engine in enumerate(engines):
            start = time.process_time()
            engine(state, runs, np.arange(LANES), command, *timing, *unlisted, *outs[e])
            if n:  # the first call compiles
                best[e] = min(best[e], (time.process_time() - start) / LANES)
    # the compiler contracts and reorders a + b c by what is left of an expression, so the last bit may differ
    farthest = max(float(np.abs(a - b).max() / np.abs(b).max()) for a, b in zip(*outs, strict=True))
    print("| kernel | best of the nominal run of 1 s (ms) |\n|---|---|")
    print(f"| with the catalogue's terms | {1e3 * best[0]:.2f} |")
    print(f"| {replaced} effect fields written out | {1e3 * best[1]:.2f} |")
    print(f"\nratio {best[0] / best[1]:.3f} (demanded: at most {LIMIT}); recorded signals ", end="")
    print(f"differ by at most {farthest:.1e} of their largest value (rounding: {ROUNDING:.0e})")
    if best[0] > LIMIT * best[1] or farthest > ROUNDING:
        sys.exit(1)


if __name__ == "__main__":
    main()
