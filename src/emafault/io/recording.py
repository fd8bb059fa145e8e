"""The recording format: one netCDF-4 file holds one recording of the actuator, simulated or measured.

Reading and writing live here together. Arrays in memory have the phase as their trailing axis, (time, phase); in
the file it leads, (phase, time).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, shown
from ..faults import FAULT_NAMES
from ..places import file_at, kind
from .atomic import replace_atomically

PHASES = ("a", "b", "c")
#: name -> (has a phase axis, unit, required, long name)
VARIABLES: dict[str, tuple[bool, str, bool, str]] = {
    "phase_voltage": (True, "V", True, "terminal to star point, mean over the interval"),
    "phase_current": (True, "A", True, "mean over the interval, positive into the motor"),
    "phase_current_end": (True, "A", False, "current at the interval's end"),
    "rotor_speed": (False, "rad/s", True, "mechanical speed, mean over the interval"),
    "rotor_angle": (False, "rad", True, "mechanical angle, unwrapped, at the interval's end"),
    "output_position": (False, "rad", True, "user shaft, at the interval's end"),
    "commanded_position": (False, "rad", True, "user shaft, at the interval's end"),
    "bus_voltage": (False, "V", False, "mean over the interval"),
}
MINIMUM_DURATION = 0.2  # s
#: variable -> attributes that a recording may have which was not born in the format, besides ``noise`` of any variable
KNOWN = {"phase_voltage": ("reference",), "phase_current": ("derived",), "rotor_angle": ("source", "zero_error")}
REFERENCES = ("star", "modelled_star")  # of phase voltages that are read here
MINIMUM_SAMPLES = 100  # 2 ms apart, in the least duration
#: what no actuator has, by unit: larger values are of another unit or of none
LARGEST = {"s": 1e9, "V": 1e6, "A": 1e6, "rad/s": 1e6, "rad": 1e8, "degC": 1e6}
LARGEST_FAULT = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1000.0])


@dataclass(frozen=True, repr=False)
class Recording:
    """One recording; voltages (V), currents (A), speed (rad/s), angles (rad), ambient temperature (degC)."""

    time: np.ndarray  # (time,) s, end of each interval
    phase_voltage: np.ndarray  # (time, phase)
    phase_current: np.ndarray  # (time, phase)
    rotor_speed: np.ndarray  # (time,)
    rotor_angle: np.ndarray  # (time,)
    output_position: np.ndarray  # (time,)
    commanded_position: np.ndarray  # (time,)
    ambient_temperature: float
    phase_current_end: np.ndarray | None = None  # (time, phase)
    bus_voltage: np.ndarray | None = None  # (time,)
    fault: np.ndarray | None = None  # (6,)
    attributes: dict[str, str] = field(default_factory=dict)
    known: dict[str, dict[str, Any]] = field(default_factory=dict)  # variable -> what is known of it, see ``KNOWN``
    name: str = ""

    @property
    def interval(self) -> float:
        """Recording interval (s)."""
        return float((self.time[-1] - self.time[0]) / (len(self.time) - 1))

    def __repr__(self) -> str:
        samples = f"{len(self.time)} samples of {self.interval:g} s"
        return f"Recording {self.name}: {samples}, {self.health}, ambient at {self.ambient_temperature:.1f} degC"

    @property
    def health(self) -> str:
        """``healthy``, ``unknown`` or ``seeded``; a file that does not say is ``unknown``."""
        return self.attributes.get("health", "unknown")


def write_recording(path: str | Path, recording: Recording) -> None:
    """Write one recording in the format.

    Raises
    ------
    InputError : the file cannot be written
    """
    import netCDF4

    def write(temporary: Path) -> None:
        with netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
            file.createDimension("time", len(recording.time))
            file.createDimension("phase", 3)
            phase = file.createVariable("phase", str, ("phase",))
            for j, letter in enumerate(PHASES):
                phase[j] = letter
            time = file.createVariable("time", "f8", ("time",), zlib=True, complevel=1)
            time.units, time.long_name = "s", "end of each recording interval"
            time[:] = recording.time
            for name, (phased, unit, _, long_name) in VARIABLES.items():
                values = getattr(recording, name)
                if values is None:
                    continue
                dims = ("phase", "time") if phased else ("time",)
                variable = file.createVariable(name, "f8", dims, zlib=True, complevel=1)
                variable.units, variable.long_name = unit, long_name
                variable.setncatts(recording.known.get(name, {}))
                variable[:] = values.T if phased else values
            ambient = file.createVariable("ambient_temperature", "f8", ())
            ambient.units, ambient.long_name = "degC", "measured ambient temperature, which the winding starts at"
            ambient[...] = recording.ambient_temperature
            if recording.fault is not None:
                file.createDimension("component", 6)
                component = file.createVariable("component", str, ("component",))
                for j, label in enumerate(FAULT_NAMES):
                    component[j] = label
                fault = file.createVariable("fault", "f8", ("component",))
                fault.long_name = "fault vector; Na, Nb, Nc, xi_x, xi_y (1), dT (K)"
                fault[:] = recording.fault
            attributes = {"title": "electromechanical actuator recording", "command": "unknown"}
            attributes |= {"health": "unknown", "unit": "unknown", "Conventions": "CF-1.11"}
            for key, value in (attributes | recording.attributes).items():
                file.setncattr(key, value)

    replace_atomically(Path(path), write)


def read_recording(path: str | Path) -> Recording:
    """Read and check one recording.

    Raises
    ------
    InputError : naming the file, the variable and the rule broken
    """
    import netCDF4

    path = file_at(path)
    try:
        file = netCDF4.Dataset(path)
    except (OSError, RuntimeError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{shown(path)}: not a readable netCDF-4 file ({reason})") from error
    with file:
        file.set_auto_mask(True)
        try:
            return _read_open(path, file)
        except InputError as error:
            raise InputError(f"{shown(path)}: {error}") from None
        except (RuntimeError, OSError, ValueError, AttributeError) as error:
            raise InputError(f"{shown(path)}: the file is truncated or damaged ({error})") from error


def _read_open(path: Path, file) -> Recording:
    _check_layout(file)
    time = _values(file, "time", ("time",), "s")
    _check_time(time)
    data: dict[str, np.ndarray | None] = {}
    known: dict[str, dict[str, Any]] = {}
    for name, (phased, unit, _, _) in VARIABLES.items():
        if name not in file.variables:
            data[name] = None
            continue
        data[name] = np.ascontiguousarray(_values(file, name, ("phase", "time") if phased else ("time",), unit).T)
        known[name] = _known(file.variables[name])
    reference = known["phase_voltage"].get("reference", "star")
    if reference not in REFERENCES:
        raise InputError(f"phase_voltage has the reference '{reference}', read are {' and '.join(REFERENCES)}")
    speed = data["rotor_speed"]
    assert speed is not None
    if not np.any(speed != 0.0):
        raise InputError("rotor_speed never leaves zero; a recording in motion is needed")
    return Recording(
        time=time,
        ambient_temperature=float(_values(file, "ambient_temperature", (), "degC")),
        fault=_fault(file) if "fault" in file.variables else None,
        attributes=_attributes(file),
        known={name: said for name, said in known.items() if said},
        name=path.name,
        **data,  # type: ignore[arg-type]
    )


def _check_layout(file) -> None:
    """Refuse a file that lacks a variable or is no single recording of three phases."""
    required = ["time", *(n for n, spec in VARIABLES.items() if spec[2]), "ambient_temperature"]
    for name in required:
        if name not in file.variables:
            raise InputError(f"the required variable {name} is missing")
    if "run" in file.dimensions:
        raise InputError("has a run dimension; a dataset is not a recording, one run per file is accepted")
    if "phase" not in file.dimensions or len(file.dimensions["phase"]) != 3:
        raise InputError("the dimension phase must have the three entries a, b, c")


def _values(file, name: str, dims: tuple[str, ...], unit: str | None) -> np.ndarray:
    """A variable's values: of the format's dimensions and unit, finite, and no larger than any actuator has."""
    variable = file.variables[name]
    if variable.dimensions != dims:
        raise InputError(f"{name} has dimensions {variable.dimensions}, the format asks for {dims}")
    got = getattr(variable, "units", None)
    if unit is not None and got != unit:
        raise InputError(f"{name} has unit '{got}', the format asks for '{unit}'")
    if not np.issubdtype(variable.dtype, np.number):
        raise InputError(f"{name} is not numeric")
    data: np.ndarray = np.ma.filled(np.ma.asarray(variable[...], dtype=float), np.nan)
    if not np.all(np.isfinite(data)):
        raise InputError(f"{name} holds NaN, infinite or missing values; none are accepted")
    largest = LARGEST.get(unit or "", np.inf)
    if np.any(np.abs(data) > largest):
        raise InputError(f"{name} reaches {np.max(np.abs(data)):.3g} {unit}, accepted is up to {largest:g} {unit}")
    return data


def _check_time(time: np.ndarray) -> None:
    """Refuse times that are too few or too short, or not at one constant interval."""
    if len(time) < 2:
        raise InputError(f"time has {len(time)} samples; at least {MINIMUM_SAMPLES} are needed")
    steps = np.diff(time)
    if np.any(steps <= 0):
        raise InputError("time does not increase everywhere")
    step = (time[-1] - time[0]) / (len(time) - 1)
    if np.max(np.abs(steps - step)) > 1e-3 * step:
        raise InputError("time is not uniform; the format asks for one constant interval")
    if step * len(time) < MINIMUM_DURATION * (1 - 1e-9):
        raise InputError(f"holds {step * len(time):.3g} s of data; at least {MINIMUM_DURATION} s are needed")
    if len(time) < MINIMUM_SAMPLES:
        raise InputError(f"time has {len(time)} samples; at least {MINIMUM_SAMPLES} are needed")


def _known(variable) -> dict[str, Any]:
    """What a file says of a variable beyond the format: see ``KNOWN``."""
    said = variable.ncattrs()
    known = {k: variable.getncattr(k) for k in ("noise", *KNOWN.get(variable.name, ())) if k in said}
    for name, unit in (("noise", "its unit"), ("zero_error", "electrical rad")):
        value = known.get(name, 1.0)
        if not (isinstance(value, int | float | np.number) and 0.0 < float(value) < np.inf):
            raise InputError(f"{variable.name} has {name} '{value}', accepted is a positive number in {unit}")
    return known


def _fault(file) -> np.ndarray:
    fault = _values(file, "fault", ("component",), None)
    if fault.shape != (6,):
        raise InputError(f"fault has {fault.size} components, the format asks for 6")
    if np.any(np.abs(fault) > LARGEST_FAULT):
        raise InputError(f"fault is {fault.tolist()}, accepted is up to {LARGEST_FAULT.tolist()}")
    return fault


def _attributes(file) -> dict[str, str]:
    attributes = {key: str(file.getncattr(key)) for key in file.ncattrs()}
    health = attributes.get("health", "unknown")
    if health not in ("healthy", "unknown", "seeded"):
        raise InputError(f"health is '{health}', accepted are healthy, unknown and seeded")
    return attributes


def recordings_in(paths: Mapping[str, Path] | list[str | Path]) -> list[Path]:
    """Files named by a list of files and folders; a folder stands for its ``*.nc`` files in order of name.

    Raises
    ------
    InputError : a path that does not exist or a folder without recordings
    """
    found: list[Path] = []
    for entry in paths:
        path = Path(entry)
        if kind(entry) == "folder":
            inside = sorted(p for p in path.glob("*.nc") if not p.name.startswith("."))
            if not inside:
                raise InputError(f"{shown(path)}: the folder holds no recording (*.nc)")
            found += inside
        elif kind(entry):
            found.append(file_at(entry))
        else:
            raise InputError(f"{shown(path)}: no such file or folder")
    return found
