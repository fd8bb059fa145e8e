"""Cramer-Rao bounds of the faults of fresh runs, one for each kind of features, and of calibrated units."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.commands import command_positions
from ..actuator.parameters import ActuatorParameters
from ..actuator.simulate import simulate
from ..actuator.unlisted import in_machine
from ..dataset import BLOCK, sample_runs
from ..errors import InputError
from ..faults import FAULT_NAMES
from ..identification.posterior import Knowledge
from ..io.atomic import replace_atomically
from ..progress import progress
from .calibrated_bound import SIX, HealthyUnits, coefficient_bound, least_of

BOUNDS = (*SIX, "recording", "heating")
CALIBRATED = "_calibrated"  # behind the name of a bound: of units with healthy recordings


def compute_bound(spec: Mapping[str, Any], output: str | Path) -> None:
    """Cramer-Rao standard deviations of the first fresh runs' faults.

    ``plateau`` and ``floating`` are those of six features, from plateau samples and with floating ones too;
    ``recording`` is that of all intervals of the recording with L among the coefficients, ``heating`` the same where
    the rate at which the winding warms is unknown, too (left out where no method asks for it). All count what is known
    of R0, k0, L0 and the magnets' lag beforehand. With ``_calibrated`` behind they are those of units that have healthy
    recordings. They are NaN where the bounds do not hold: without noise, and under the rotor-angle laws, whose R, k
    carry no xi.

    Parameters
    ----------
    spec : the sub-tree ``config.bound_spec``

    Raises
    ------
    InputError : the file cannot be written
    """
    import xarray as xr

    part = spec["dataset"]
    recording, settings = part["recording"], dict(part["command"])
    settings.pop("digest", None)
    positions = command_positions(
        settings.pop("name"), settings, recording["duration"], part["actuator"]["control_period"]
    )
    sample = sample_runs(part)
    runs, faults = sample.records(slice(spec["runs"])), sample.faults[: spec["runs"]]
    actuator, known, alpha_m = (
        ActuatorParameters(**part["actuator"]),
        Knowledge(**spec["known"]),
        spec["magnet_coefficient"],
    )
    names = tuple(name for name in BOUNDS if name != "heating" or spec["heating"])
    healthy = HealthyUnits(spec, positions) if spec["reference"] else None
    every = [*names, *(name + CALIBRATED for name in names if healthy)]
    found: dict[str, list[np.ndarray]] = {name: [] for name in every}
    holds = part["sensors"]["voltage"] > 0.0 and part["faults"]["law"] == "stator_fixed"
    for start in progress(range(0, len(runs), BLOCK), "bound", -(-len(runs) // BLOCK)):
        rows = slice(start, min(start + BLOCK, len(runs)))
        some = runs[rows]
        if not holds:
            for parts in found.values():
                parts.append(np.full((len(some), 6), np.nan))
            continue
        terms = in_machine(part.get("unlisted", ()), len(some), part["seed"], start)
        interval, noise = recording["interval"], part["sensors"]
        clean = simulate(some, positions, recording["duration"], interval, terms=terms)
        units = healthy.covariances(rows, names) if healthy else {}
        of_run = faults[rows], actuator, alpha_m, known, sample.dT_magnet[rows]
        for name in names:
            covariance = coefficient_bound(name, clean, interval, actuator, noise, spec["discard"])
            found[name].append(least_of(covariance, known.covariance(), *of_run))
            if healthy:
                found[name + CALIBRATED].append(least_of(covariance, units[name], *of_run))
    data = xr.Dataset(
        {name: (("run", "component"), np.concatenate(parts)) for name, parts in found.items()}
        | {"fault": (("run", "component"), faults)},
        {"component": list(FAULT_NAMES)},
        {"title": "Cramer-Rao standard deviation of each fault", "Conventions": "CF-1.11"},
    )
    replace_atomically(Path(output), lambda temporary: data.to_netcdf(temporary, engine="netcdf4"))


def read_bound(path: str | Path) -> dict[str, np.ndarray | None]:
    """Each bound of ``compute_bound`` -> (6,) standard deviation averaged over runs, None where none holds.

    Raises
    ------
    InputError : a file that cannot be read, or not one of these
    """
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="netcdf4") as data:
            names = [str(name) for name in data.data_vars if name != "fault"]
            means = {name: np.mean(data[name].values, axis=0) for name in names}
            for name in (*SIX, "recording"):
                means[name]
    except (OSError, KeyError) as error:
        raise InputError(f"{path}: not a readable bound ({error})") from error
    return {name: mean if np.all(np.isfinite(mean)) else None for name, mean in means.items()}
