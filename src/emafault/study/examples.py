"""Data of the paper's figures: the worked example's back-EMF coefficient and single recordings of different faults."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..dataset import simulate_blocks
from ..faults import WORKED_EXAMPLE
from ..io.atomic import replace_atomically
from ..reconstruction import reconstruct

CUTOFF = 300.0  # Hz, of the paper's zero-phase low-pass
THRESHOLD = 0.5  # of k0, smaller values are dropped by the paper


def conditions(faults: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Fault vectors that are shown, by label: the worked example, healthy, and each fault at its largest."""
    N, xi, dT = (faults[key]["high"] for key in ("N", "xi", "dT"))
    return {
        "worked example of the paper": np.array(WORKED_EXAMPLE),
        "healthy, 20 °C": np.zeros(6),
        f"N_a = {N:g}": np.array([N, 0, 0, 0, 0, 0]),
        f"eccentricity {xi:g}": np.array([0, 0, 0, xi, 0, 0]),
        f"{dT:+g} K": np.array([0, 0, 0, 0, 0, dT]),
    }


def simulate_examples(spec: Mapping[str, Any], output: str | Path) -> None:
    """Simulate the conditions shown and reconstruct k_a of the worked example sample by sample, as the paper does.

    Parameters
    ----------
    spec : the sub-tree ``config.examples_spec``

    Raises
    ------
    InputError : the file cannot be written
    """
    import xarray as xr
    from scipy.signal import butter, sosfiltfilt

    part, discard = {**spec["dataset"], "tolerance": 0.0, "recordings_of_a_unit": 1}, spec["discard"]
    shown = conditions(part["faults"])
    faults = np.array(list(shown.values()))
    (block,) = simulate_blocks(part, 0, len(faults), faults)
    signals, interval = block.signals, block.interval
    actuator = ActuatorParameters(**part["actuator"])
    low_pass = butter(2, min(CUTOFF, 0.45 / interval), fs=1.0 / interval, output="sos")
    first = round(discard / interval)
    V, i, w = (
        sosfiltfilt(low_pass, signal)[first:]
        for signal in (signals["phase_voltage"][0, :, 0], signals["phase_current"][0, :, 0], signals["rotor_speed"][0])
    )
    theta = signals["rotor_angle"][0] - 0.5 * interval * signals["rotor_speed"][0]  # middle of the interval
    moving = np.abs(w) > 1.0
    k_prime, ratio = (V - actuator.resistance * i)[moving] / w[moving], i[moving] / w[moving]
    angle = (actuator.pole_pairs * theta[first:])[moving] % (2.0 * np.pi)
    fit = reconstruct("paper", {n: v[:1] for n, v in signals.items()}, interval, actuator, {"discard": discard})
    data = xr.Dataset(
        {
            "time": ("time", interval * np.arange(1, signals["rotor_speed"].shape[1] + 1), {"units": "s"}),
            "current": (("condition", "time", "phase"), signals["phase_current"], {"units": "A"}),
            "voltage": (("condition", "time", "phase"), signals["phase_voltage"], {"units": "V"}),
            "k_prime": ("sample", k_prime, {"units": "V s/rad"}),
            "ratio": ("sample", ratio, {"units": "A s/rad"}),
            "angle": ("sample", angle, {"units": "rad", "long_name": "electrical"}),
            "kept": ("sample", (np.abs(k_prime) > THRESHOLD * actuator.back_emf).astype("i1")),
        },
        {"condition": list(shown)},
        {
            "title": "data of the paper's figures",
            "slope": float(fit.R[0, 0] - actuator.resistance),
            "level": float(fit.k[0, 0]),
            "nominal_back_emf": actuator.back_emf,
            "pole_pairs": actuator.pole_pairs,
        },
    )
    replace_atomically(Path(output), lambda temporary: data.to_netcdf(temporary, engine="netcdf4"))
