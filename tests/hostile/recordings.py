"""Files that are no recording, or one with something wrong in it."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from emafault.io.recording import Recording, read_recording, write_recording

from .entries import Entry, Prepare, entry, file

BAD = "bad.nc"


def damaged(change: Callable[[Recording], Recording]) -> Prepare:
    """The good recording with other contents."""
    return lambda folder: write_recording(folder / BAD, change(read_recording(folder / "good.nc")))


def edited(edit: Callable[[Any], object]) -> Prepare:
    """The good recording's file opened and edited."""

    def prepare(folder: Path) -> None:
        import netCDF4

        shutil.copy(folder / "good.nc", folder / BAD)
        with netCDF4.Dataset(folder / BAD, "a") as opened:
            edit(opened)

    return prepare


def array(name: str, of: Callable[[np.ndarray], np.ndarray]) -> Prepare:
    """The good recording with one array changed."""
    return damaged(lambda r: replace(r, **{name: of(getattr(r, name).copy())}))


def one(value: float) -> Callable[[np.ndarray], np.ndarray]:
    """One sample set to a value."""

    def change(x: np.ndarray) -> np.ndarray:
        x[7] = value
        return x

    return change


def bytes_of(change: Callable[[bytes], bytes]) -> Prepare:
    """The good recording's bytes changed."""
    return lambda folder: (folder / BAD).write_bytes(change((folder / "good.nc").read_bytes()))


def rewritten(**of: Any) -> Prepare:
    """A netCDF file made by hand: ``dims``, ``variables`` (name -> dims, units, values)."""

    def prepare(folder: Path) -> None:
        import netCDF4

        with netCDF4.Dataset(folder / BAD, "w") as out:
            for name, size in of.get("dims", {}).items():
                out.createDimension(name, size)
            for name, (dims, units, values) in of.get("variables", {}).items():
                values = np.asarray(values)
                variable = out.createVariable(name, str if values.dtype.kind in "UO" else values.dtype, dims)
                variable.units = units
                variable[...] = values

    return prepare


def without(name: str) -> Prepare:
    return edited(lambda f: f.renameVariable(name, f"other_{name}"))


def units(name: str, text: str) -> Prepare:
    return edited(lambda f: f[name].setncattr("units", text))


def first(samples: int) -> Prepare:
    """The first samples alone."""
    return damaged(lambda r: replace(r, **{n: getattr(r, n)[:samples] for n in ("time", *SIGNALS)}))


SIGNALS = (
    "phase_voltage",
    "phase_current",
    "rotor_speed",
    "rotor_angle",
    "output_position",
    "commanded_position",
    "phase_current_end",
    "bus_voltage",
)
UNIT = {"phase_voltage": "V", "phase_current": "A", "rotor_speed": "rad/s", "rotor_angle": "rad", "time": "s"}

#: what is wrong -> how it is made, and what must be named beside the file
DAMAGES: dict[str, tuple[Prepare, tuple[str, ...]]] = {
    "empty": (file(BAD, b""), ("netCDF",)),
    "text": (file(BAD, "time,voltage\n0,1\n"), ("netCDF",)),
    "zeros": (file(BAD, b"\0" * 4096), ("netCDF",)),
    "signature alone": (file(BAD, b"\x89HDF\r\n\x1a\n"), ("netCDF",)),
    "classic signature": (file(BAD, b"CDF\x01" + b"\0" * 100), ("bad.nc",)),
    "zip": (file(BAD, b"PK\x03\x04" + b"\0" * 200), ("netCDF",)),
    "cut at a third": (bytes_of(lambda b: b[: len(b) // 3]), ()),
    "cut by a byte": (bytes_of(lambda b: b[:-1]), ()),
    "cut at half": (bytes_of(lambda b: b[: len(b) // 2]), ()),
    "middle overwritten": (bytes_of(lambda b: b[: len(b) // 2] + b"\xff" * 20_000 + b[len(b) // 2 + 20_000 :]), ()),
    "no variable": (rewritten(dims={"time": 10}), ("time is missing",)),
    "two samples far apart": (
        damaged(lambda r: replace(r, **{n: x[[0, -1]] for n, x in vars(r).items() if np.ndim(x) and n != "fault"})),
        ("samples",),
    ),
    "two samples 1000 s apart": (
        damaged(
            lambda r: replace(
                r,
                time=np.array([0.0, 1e3]),
                **{n: getattr(r, n)[:2] for n in SIGNALS},
            )
        ),
        ("samples",),
    ),
    "three samples": (
        damaged(lambda r: replace(r, time=np.array([0.0, 1.0, 2.0]), **{n: getattr(r, n)[:3] for n in SIGNALS})),
        ("samples",),
    ),
    "one sample": (first(1), ("time", "1 sample")),
    "no sample": (first(0), ("time", "0 samples")),
    "0.1 s": (first(500), ("0.2 s",)),
    "time backwards": (array("time", lambda t: t[::-1].copy()), ("time does not increase",)),
    "time constant": (array("time", lambda t: 0.0 * t), ("time does not increase",)),
    "time jumps": (array("time", lambda t: t + 0.1 * (t > 0.15)), ("time is not uniform",)),
    "time in ms": (array("time", lambda t: 1e3 * t), ()),
    "time of 1e300": (array("time", lambda t: 1e300 * t), ("time",)),
    "time of 1e-300": (array("time", lambda t: 1e-300 * t), ("s of data",)),
    "time without end": (array("time", one(np.inf)), ("time holds",)),
    **{
        f"NaN in {n}": (array(n, one(np.nan)), (f"{n} holds NaN",)) for n in SIGNALS
    },
    **{f"infinite {n}": (array(n, one(-np.inf)), (f"{n} holds",)) for n in SIGNALS},
    **{f"{n} of 1e300": (array(n, lambda x: x + 1e300), (n,)) for n in SIGNALS},
    **{f"a sample of {n} at 1e30": (array(n, one(1e30)), (n,)) for n in SIGNALS},
    **{f"{n} lacks": (without(n), (n, "missing")) for n in SIGNALS[:6]},
    **{f"unit of {n}": (units(n, "furlong"), (n, "furlong", f"'{UNIT[n]}'")) for n in UNIT},
    **{
        f"constant {n}": (array(n, lambda x: 0.0 * x + 1.5), (n,))
        for n in ("phase_current", "phase_voltage", "output_position")
    },
    "currents of zero": (array("phase_current", lambda x: 0.0 * x), ("phase_current",)),
    "voltages of zero": (array("phase_voltage", lambda x: 0.0 * x), ("phase_voltage",)),
    "one current dead": (array("phase_current", lambda x: x * [1.0, 0.0, 1.0]), ("phase_current",)),
    "speed of zero": (array("rotor_speed", lambda x: 0.0 * x), ("rotor_speed never leaves zero",)),
    "angle of zero": (array("rotor_angle", lambda x: 0.0 * x), ()),
    "random numbers": (
        damaged(
            lambda r: replace(r, **{n: np.random.default_rng(1).normal(size=getattr(r, n).shape) for n in SIGNALS})
        ),
        (),
    ),
    "voltages in mV": (array("phase_voltage", lambda x: 1e3 * x), ()),
    "currents with the wrong sign": (
        damaged(lambda r: replace(r, phase_current=-r.phase_current, phase_current_end=-r.phase_current_end)),
        (),
    ),
    "ambient at 1e4 degC": (damaged(lambda r: replace(r, ambient_temperature=1e4)), ("ambient_temperature",)),
    "ambient below 0 K": (damaged(lambda r: replace(r, ambient_temperature=-300.0)), ("ambient_temperature",)),
    "ambient at NaN": (damaged(lambda r: replace(r, ambient_temperature=np.nan)), ("ambient_temperature",)),
    "ambient with an axis": (
        edited(lambda f: (f.renameVariable("ambient_temperature", "x"), _ambient(f, ("phase",)))),
        ("ambient_temperature has dimensions",),
    ),
    "no ambient": (without("ambient_temperature"), ("ambient_temperature is missing",)),
    "health": (damaged(lambda r: replace(r, attributes={"health": "fine"})), ("health is 'fine'", "healthy")),
    "health of two lines": (damaged(lambda r: replace(r, attributes={"health": "a\nb"})), ("health",)),
    "health a number": (edited(lambda f: f.setncattr("health", 3)), ("health",)),
    "a run axis": (edited(lambda f: f.createDimension("run", 3)), ("run dimension",)),
    "text for numbers": (
        edited(lambda f: (f.renameVariable("rotor_speed", "x"), _text(f, "rotor_speed"))),
        ("rotor_speed is not numeric",),
    ),
    "phases of two": (
        rewritten(
            dims={"time": 1000, "phase": 2},
            variables={
                "time": (("time",), "s", 2e-4 * np.arange(1000)),
                **{n: (("phase", "time"), "V", np.ones((2, 1000))) for n in SIGNALS[:2]},
                **{n: (("time",), "rad", np.ones(1000)) for n in SIGNALS[2:6]},
                "ambient_temperature": ((), "degC", 20.0),
            },
        ),
        ("phase must have the three",),
    ),
    "axes swapped": (
        edited(lambda f: (f.renameVariable("phase_voltage", "x"), _swapped(f))),
        ("phase_voltage has dimensions",),
    ),
    "fault of NaN": (damaged(lambda r: replace(r, fault=np.full(6, np.nan))), ("fault",)),
    "fault of 1e300": (damaged(lambda r: replace(r, fault=np.full(6, 1e300))), ("fault",)),
    "unit not of ours": (units("ambient_temperature", "K"), ("ambient_temperature has unit 'K'",)),
    "line to line voltages": (
        edited(lambda f: f["phase_voltage"].setncattr("reference", "line_to_line")),
        ("phase_voltage", "line_to_line"),
    ),
    "reference unknown": (
        edited(lambda f: f["phase_voltage"].setncattr("reference", "moon")),
        ("phase_voltage", "moon"),
    ),
    "a group beside": (edited(lambda f: f.createGroup("extra")), ()),
}  # fmt: skip


def _ambient(opened: Any, dims: tuple[str, ...]) -> None:
    variable = opened.createVariable("ambient_temperature", "f8", dims)
    variable.units = "degC"
    variable[:] = 20.0


def _text(opened: Any, name: str) -> None:
    variable = opened.createVariable(name, str, ("time",))
    variable.units = "rad/s"


def _swapped(opened: Any) -> None:
    variable = opened.createVariable("phase_voltage", "f8", ("time", "phase"))
    variable.units = "V"
    variable[...] = 1.0


#: damages that leave a recording that may be used: the entry must then end with 0
HARMLESS = {"a group beside"}


def _entries() -> dict[str, Entry]:
    found = {}
    for name, (prepare, says) in DAMAGES.items():
        named = () if name in HARMLESS else (BAD, *says)
        found[f"identify, {name}"] = entry(f"identify {BAD} --experiment smoke", *named, prepare=prepare)
    for name in ("empty", "cut at half", "two samples far apart", "constant phase_current", "phase_voltage of 1e300"):
        prepare, says = DAMAGES[name]
        found[f"diagnose, {name}"] = entry(f"diagnose {BAD} --no-tracking", BAD, *says, prepare=prepare)
        found[f"plan, {name}"] = entry(f"plan {BAD}", BAD, *says, prepare=prepare)
        if name.startswith("constant"):
            continue  # its health is refused first
        found[f"reference, {name}"] = entry(
            f"identify good.nc --experiment smoke --reference {BAD}", BAD, *says, prepare=prepare
        )
    return found


ENTRIES = _entries()
