"""Datasets: many simulated runs in a few netCDF files (shards), as in the recording format with a leading run axis.

A shard is written block by block, so that memory does not grow with the number of runs, to a temporary name that is
renamed at the end. Every run is seeded by its own number: the values do not depend on how runs are shared out.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import __version__
from .actuator.parameters import ActuatorParameters, make_runs
from .effects import EFFECTS
from .errors import InputError
from .faults import FAULT_NAMES, sample_faults
from .filters import low_passed, undone
from .io.atomic import replace_atomically, write_text
from .io.recording import PHASES, VARIABLES, Recording
from .places import file_at
from .progress import progress, say

BLOCK = 25  # runs simulated, written and read at a time
FASTEST = 5.0  # times the speed at which the back-EMF of a phase is the bus voltage
#: parameter of the actuator, the effect that has its tolerance and the factor's name there
_UNIT = (
    ("resistance", "unit_calibration", "R_scale"),
    ("back_emf", "unit_calibration", "k_scale"),
    ("inductance", "inductance_tolerance", "L_scale"),
)
CHUNK_CACHE = 2**20  # bytes a variable; chunks are written and read whole, the library's 16 MB would only fill up


@dataclass(frozen=True)
class Block:
    """Consecutive runs; signals as in ``actuator.simulate``, and ``ambient_temperature`` (run,) in degC."""

    first_run: int
    interval: float  # s
    signals: dict[str, np.ndarray]  # (run, time, phase) or (run, time)
    faults: np.ndarray  # (run, 6)


def shard_bounds(runs: int, shards: int, shard: int) -> tuple[int, int]:
    """First run of a shard and the run after its last."""
    return runs * shard // shards, runs * (shard + 1) // shards


@dataclass(frozen=True)
class Sample:
    """What is drawn for every run of one part; records, which are large, are made for the rows asked for."""

    spec: Mapping[str, Any]  # the sub-tree ``config.dataset_spec``
    faults: np.ndarray  # (run, 6)
    dT_magnet: np.ndarray  # (run,) K
    theta_0: np.ndarray  # (run,) rad
    spread: dict[str, np.ndarray]  # field of a run's record -> (unit,) factor of its tolerance

    def records(self, rows: slice) -> np.ndarray:
        """(row,) records of ``RUN_DTYPE``."""
        runs = make_runs(
            ActuatorParameters(**self.spec["actuator"]),
            self.faults[rows],
            effects=self.spec["effects"],
            eccentricity_law=self.spec["faults"]["law"],
            dT_magnet=self.dT_magnet[rows],
            theta_0=self.theta_0[rows],
        )
        unit = np.arange(len(self.faults))[rows] // self.spec["recordings_of_a_unit"]
        for field, factor in self.spread.items():
            runs[field] *= factor[unit]
        return runs


def sample_runs(spec: Mapping[str, Any], faults: np.ndarray | None = None) -> Sample:
    """Draw the runs of one part of a dataset.

    Parameters
    ----------
    spec : the sub-tree ``config.dataset_spec``
    faults : (run, 6) given fault vectors; None samples them
    """
    ranges, repeats, seed = spec["faults"], spec["recordings_of_a_unit"], spec["seed"]
    if faults is None:
        faults = sample_faults(
            spec["runs"] * repeats,
            shorted_turns=(ranges["N"]["low"], ranges["N"]["high"]),
            eccentricity=(ranges["xi"]["low"], ranges["xi"]["high"]),
            temperature=(ranges["dT"]["low"], ranges["dT"]["high"]),
            scheme=spec["scheme"],
            seed=seed,
        )
        if spec["healthy"]:
            faults[:, :5] = 0.0
    number = len(faults)
    lag, angle = spec["magnet_lag"], spec["recording"]["theta_0"]
    colder = np.random.default_rng([seed, 2]).uniform(lag["low"], lag["high"], number)
    theta_0 = np.random.default_rng([seed, 3]).uniform(angle["low"], angle["high"], number)
    spread = {}
    if spec["tolerance"]:
        rng = np.random.default_rng([spec["unit_seed"], 4])
        given = spec.get("tolerances", {})
        for effect in (EFFECTS[name] for name in spec["spread_of"] or EFFECTS):
            for name, parameter in effect.parameters.items():
                if parameter.tolerance:
                    own = given.get(effect.id, {}).get(name, parameter.tolerance)
                    deviation = spec["tolerance"] * own
                    spread[effect.field(name)] = 1.0 + deviation * rng.standard_normal(number // repeats)
    return Sample(spec, faults, faults[:, 5] - colder, theta_0, spread)


def unit_parameters(spec: Mapping[str, Any]) -> np.ndarray:
    """(run, 9) R0 (ohm), k0 (V s/rad) and L0 (H) of phases a, b, c of each run's unit, as its tolerances make them.

    Parameters
    ----------
    spec : the sub-tree ``config.dataset_spec``
    """
    sample, actuator = sample_runs(spec), spec["actuator"]
    unit = np.arange(len(sample.faults)) // spec["recordings_of_a_unit"]
    out = np.empty((len(unit), 9))
    for n, (key, effect, scale) in enumerate(_UNIT):
        factor = sample.spread.get(EFFECTS[effect].field(scale))
        out[:, 3 * n : 3 * n + 3] = actuator[key] * (np.ones(len(unit)) if factor is None else factor[unit])[:, None]
    return out


def simulate_blocks(
    spec: Mapping[str, Any], first: int, last: int, faults: np.ndarray | None = None
) -> Iterator[Block]:
    """Simulate and measure runs ``first`` to ``last - 1`` of a part, block by block; faults as in ``sample_runs``."""
    from .actuator.commands import command_positions

    recording, settings = spec["recording"], dict(spec["command"])
    settings.pop("digest", None)
    duration, interval = recording["duration"], recording["interval"]
    command = command_positions(settings.pop("name"), settings, duration, spec["actuator"]["control_period"])
    sample = sample_runs(spec, faults)
    for start in range(first, last, BLOCK):
        rows = slice(start, min(start + BLOCK, last))
        runs = sample.records(rows)
        signals = simulate_and_measure(spec, runs, command, duration, interval, start)
        _refuse_runaway(signals, spec["actuator"])
        yield Block(start, interval, signals, sample.faults[rows])


def simulate_and_measure(
    spec: Mapping[str, Any],
    runs: np.ndarray,
    command: np.ndarray,
    duration: float,
    interval: float,
    first_run: int = 0,
    recording: str = "",
) -> dict[str, np.ndarray]:
    """Recorded signals of ``sensors.measure``, with what no catalogue lists in the machine and in the measuring chain.

    Parameters
    ----------
    spec : the sub-tree ``config.dataset_spec``: its ``sensors``, ``seed`` and, if any, ``unlisted`` and the recording's
        ``filter`` are read
    runs, command, duration, interval : as ``actuator.simulate`` takes them
    first_run : number of the first run, which its noise and whatever else is left to chance go by
    recording : name of the recording that is replayed, if any
    """
    from .actuator.commands import seen_by_controller
    from .actuator.parameters import with_coefficients
    from .actuator.sensors import SensorNoise, measure
    from .actuator.simulate import commanded_position, simulate
    from .actuator.unlisted import in_machine

    unlisted, seed = spec.get("unlisted", ()), spec["seed"]
    terms = in_machine(unlisted, len(runs), seed, first_run, recording)
    runs = with_coefficients(runs, unlisted, recording)
    period = float(runs["control_period"][0])
    seen = seen_by_controller(command, unlisted, period, float(runs["position_gain"][0]))
    signals = simulate(runs, seen, duration, interval, terms=terms)
    if seen is not command:  # what is recorded is what the bench commands
        ends = interval * np.arange(1, signals["commanded_position"].shape[1] + 1)
        signals["commanded_position"][:] = commanded_position(command, period, ends)
    low_pass = spec.get("recording", {}).get("filter")
    if low_pass and low_pass["before_noise"]:
        signals = low_passed(signals, interval, low_pass)
    out = measure(signals, runs, SensorNoise(**spec["sensors"]), seed, first_run, unlisted, interval, recording)
    if low_pass and not low_pass["before_noise"]:
        out = low_passed(out, interval, low_pass)
    return undone(out, interval, low_pass) if low_pass and low_pass["undone"] else out


def _refuse_runaway(signals: Mapping[str, np.ndarray], actuator: Mapping[str, Any]) -> None:
    """Refuse simulated signals that are no numbers, or speeds (rad/s) far above what the bus voltage can drive."""
    why = "a load, an effect or a parameter of the actuator is impossible"
    for name, values in signals.items():
        if not np.all(np.isfinite(values)):
            raise InputError(f"{name}: would hold NaN or infinite values; {why}")
    largest = FASTEST * actuator["bus_voltage"] / actuator["back_emf"]
    reached = float(np.max(np.abs(signals["rotor_speed"])))
    if reached > largest:
        accepted = f"accepted is up to {largest:.3g} rad/s, {FASTEST:g} times what the bus voltage can drive"
        raise InputError(f"rotor_speed: would reach {reached:.3g} rad/s, {accepted}; {why}")


def simulate_shard(path: str | Path, spec: Mapping[str, Any], shard: int) -> None:
    """Simulate one shard of a part and write it.

    Raises
    ------
    InputError : the file cannot be written
    """
    import netCDF4

    first, last = shard_bounds(spec["runs"] * spec["recordings_of_a_unit"], spec["shards"], shard)
    samples = round(spec["recording"]["duration"] / spec["recording"]["interval"])

    def write(temporary: Path) -> None:
        with netCDF4.Dataset(temporary, "w", format="NETCDF4") as file:
            _create(file, spec, last - first, samples)
            file.setncatts({"first_run": first, "shard": shard})
            blocks = simulate_blocks(spec, first, last)
            for block in progress(blocks, f"simulate {Path(path).parent.name} {shard}", -(-(last - first) // BLOCK)):
                rows = slice(block.first_run - first, block.first_run - first + len(block.faults))
                for name, values in block.signals.items():
                    file[name][rows] = values.swapaxes(1, 2) if values.ndim == 3 else values
                file["fault"][rows] = block.faults

    replace_atomically(Path(path), write)


def simulate_recording(spec: Mapping[str, Any], fault: np.ndarray) -> Recording:
    """One simulated recording of a given fault, otherwise as a part of a dataset is simulated."""
    (block,) = simulate_blocks({**spec, "recordings_of_a_unit": 1}, 0, 1, np.asarray(fault, float)[None])
    signals = {name: values[0] for name, values in block.signals.items()}
    samples = len(signals["rotor_speed"])
    attributes = {
        "title": "simulated recording of an electromechanical actuator",
        "command": spec["command"]["name"],
        "health": "seeded" if np.any(fault[:5] != 0.0) else "healthy",
        "unit": "within tolerance" if spec["tolerance"] else "nominal",
        "software": f"emafault {__version__}",
    }
    return Recording(time=block.interval * np.arange(1, samples + 1), fault=fault, attributes=attributes, **signals)


def compile_simulation(actuator: Mapping[str, Any], output: str | Path) -> None:
    """Simulate one short run, which compiles the simulation and fills the cache of compiled code.

    Parameters
    ----------
    actuator : parameters of any actuator
    output : a text file to write; its content is always the same, so that nothing that depends on it looks changed

    Raises
    ------
    InputError : the file cannot be written
    """
    from .actuator.commands import command_positions
    from .actuator.simulate import simulate

    say("compiling the simulation: once for each version of it, up to a minute")
    parameters = ActuatorParameters(**actuator)
    command = command_positions("ramp", {"speed": 0.1}, 0.02, parameters.control_period)
    simulate(make_runs(parameters, np.zeros((1, 6))), command, 0.02, 2e-4)
    write_text(output, "compiled\n")


def _create(file, spec: Mapping[str, Any], runs: int, samples: int) -> None:
    """Dimensions, variables and attributes of a shard; one chunk holds one signal of one run."""
    for name, size in {"run": runs, "phase": 3, "time": samples, "component": 6}.items():
        file.createDimension(name, size)
    for name, labels in {"phase": PHASES, "component": FAULT_NAMES}.items():
        variable = file.createVariable(name, str, (name,))
        for j, label in enumerate(labels):
            variable[j] = label
    time = file.createVariable("time", "f8", ("time",))
    time.units, time.long_name = "s", "end of each recording interval"
    time[:] = spec["recording"]["interval"] * np.arange(1, samples + 1)
    storage = {"chunk_cache": CHUNK_CACHE}  # noise hardly compresses: a quarter less, and the job takes twice as long
    for name, (phased, unit, _, long_name) in VARIABLES.items():
        dims, chunk = (("run", "phase", "time"), (1, 3, samples)) if phased else (("run", "time"), (1, samples))
        variable = file.createVariable(name, "f4", dims, chunksizes=chunk, fill_value=False, **storage)
        variable.units, variable.long_name = unit, long_name
    ambient = file.createVariable("ambient_temperature", "f8", ("run",), fill_value=False)
    ambient.units, ambient.long_name = "degC", "measured ambient temperature, which the winding starts at"
    fault = file.createVariable("fault", "f8", ("run", "component"), fill_value=False)
    fault.long_name = "fault vector; Na, Nb, Nc, xi_x, xi_y (1), dT (K)"
    file.setncatts(
        {
            "title": "simulated recordings of an electromechanical actuator",
            "Conventions": "CF-1.11",
            "command": spec["command"]["name"],
            "health": "healthy" if spec["healthy"] else "seeded",
            "unit": "within tolerance" if spec["tolerance"] else "nominal",
            "configuration": json.dumps(spec, sort_keys=True),
            "software": f"emafault {__version__}",
        }
    )


def read_blocks(paths: Sequence[str | Path], names: Sequence[str] | None = None) -> Iterator[Block]:
    """Read shards block by block, float64, in the order of the files given.

    Parameters
    ----------
    names : signals to read; None reads all

    Raises
    ------
    InputError : a file that is missing, truncated or not a dataset
    """
    import netCDF4

    for path in map(Path, paths):
        file_at(path)
        try:
            with netCDF4.Dataset(path) as file:
                missing = [n for n in ("time", "fault", "ambient_temperature", *VARIABLES) if n not in file.variables]
                if missing or "run" not in file.dimensions:
                    raise InputError(f"{path}: not a dataset of runs, {missing[0] if missing else 'run'} is missing")
                file.set_auto_mask(False)
                for name in VARIABLES:
                    file[name].set_var_chunk_cache(CHUNK_CACHE)
                time = file["time"][:]
                interval = float((time[-1] - time[0]) / (len(time) - 1))
                first = int(file.getncattr("first_run"))
                for start in range(0, len(file.dimensions["run"]), BLOCK):
                    yield _read_block(file, slice(start, start + BLOCK), first + start, interval, names)
        except (OSError, RuntimeError, AttributeError) as error:
            raise InputError(f"{path}: not a readable dataset, damaged or of another kind ({error})") from error


def _read_block(file, rows: slice, first_run: int, interval: float, names: Sequence[str] | None) -> Block:
    signals = {}
    for name in names or VARIABLES:
        values = np.asarray(file[name][rows], dtype=float)
        signals[name] = np.ascontiguousarray(values.swapaxes(1, 2)) if VARIABLES[name][0] else values
    signals["ambient_temperature"] = np.asarray(file["ambient_temperature"][rows], dtype=float)
    return Block(first_run, interval, signals, np.asarray(file["fault"][rows], dtype=float))


def count_runs(paths: Sequence[str | Path]) -> int:
    """Number of runs in shards.

    Raises
    ------
    InputError : a file that cannot be read
    """
    import netCDF4

    total = 0
    for path in paths:
        try:
            with netCDF4.Dataset(path) as file:
                total += len(file.dimensions["run"])
        except (OSError, KeyError) as error:
            raise InputError(f"{path}: not a readable dataset ({error})") from error
    return total


def read_run(paths: Sequence[str | Path], run: int) -> Recording:
    """One run of a dataset as a recording; nothing else of the file is read.

    Raises
    ------
    InputError : no such run
    """
    import netCDF4

    for path in paths:
        with netCDF4.Dataset(path) as file:
            row = run - int(file.getncattr("first_run"))
            if 0 <= row < len(file.dimensions["run"]):
                file.set_auto_mask(False)
                block = _read_block(file, slice(row, row + 1), run, 0.0, None)
                signals = {name: values[0] for name, values in block.signals.items()}
                attributes = {key: str(file.getncattr(key)) for key in ("command", "health", "unit")}
                return Recording(
                    time=file["time"][:], fault=block.faults[0], attributes=attributes, name=f"run {run}", **signals
                )
    raise InputError(f"run {run}: there is no such run in {', '.join(map(str, paths))}")


def as_batch(recording: Recording) -> dict[str, np.ndarray]:
    """Signals of one recording with a leading run axis of length one; what the recording lacks is absent."""
    values = {name: getattr(recording, name) for name in VARIABLES}
    signals = {name: np.asarray(v, dtype=float)[None] for name, v in values.items() if v is not None}
    return signals | {"ambient_temperature": np.array([recording.ambient_temperature])}
