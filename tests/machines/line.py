"""A machine that states itself in one file: v = k w + R i, read from a CSV of w, i, v and recording."""

from pathlib import Path

import numpy as np

from emafault.machines.files import read_columns, require_finite
from emafault.machines.statement import Effect, Machine, Rows, freedom, nuisance

COLUMNS = ("w", "i", "v", "recording")
ACCURACY = 0.05  # V


def read(path: Path) -> dict:
    arrays = read_columns(path, COLUMNS)
    require_finite(path, arrays, COLUMNS, rows=10)
    return {Path(path).stem: {name: arrays[name] for name in COLUMNS}}


def build(case: str, arrays: dict) -> Machine:
    names = np.unique(arrays["recording"])
    rows = []
    for name in names:
        here = arrays["recording"] == name
        w, i, v = (arrays[c][here] for c in ("w", "i", "v"))
        variance = np.full(w.size, ACCURACY**2)
        rows.append(Rows(f"run {name:g}", "electrical", "current", i, i, v, variance, {"w": w, "i": i}))
    every = tuple(r.recording for r in rows)
    cut = (len(every) + 1) // 2
    return Machine(
        "line", case, every[:cut], every[cut:], rows, PARAMETERS, EFFECTS, {"electrical": voltage}, notes=("a line",)
    )


PARAMETERS = (
    nuisance("k", "V s/rad", 0.05, 0.02, low=0.0),
    nuisance("R", "ohm", 0.5, 0.2, low=0.0),
    freedom("constant_drop", "V_drop", "V", 0.5),
    freedom("self_heating", "heating", "1/A2", 1e-3, low=0.0),
    freedom("speed_limit", "V_fast", "V", 0.5),
)
EFFECTS = (
    Effect("constant_drop", ("electrical",)),
    Effect("self_heating", ("electrical",)),
    Effect("speed_limit", ("electrical",)),
)


def voltage(p, x):
    """Voltage (V)."""
    rise = 1 + p["heating"] * x["i"] ** 2
    return p["k"] * x["w"] + p["R"] * rise * x["i"] + p["V_drop"] + p["V_fast"] * (x["w"] > 1e4)


def recorded(seed: int = 0, runs: int = 4, count: int = 20) -> dict:
    """Arrays of a machine without any gap: speeds and currents that vary apart."""
    rng = np.random.default_rng(seed)
    w, i = rng.uniform(50, 200, runs * count), rng.uniform(2, 20, runs * count)
    v = 0.055 * w + 0.42 * i + ACCURACY * rng.standard_normal(w.size)
    return {"w": w, "i": i, "v": v, "recording": np.repeat(np.arange(runs, dtype=float), count)}


def write(path: Path, arrays: dict) -> Path:
    """The arrays as the file that ``read`` takes."""
    table = np.column_stack([arrays[c] for c in COLUMNS])
    np.savetxt(path, table, delimiter=",", header=",".join(COLUMNS), comments="")
    return path
