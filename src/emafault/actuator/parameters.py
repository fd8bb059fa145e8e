"""Parameters of one simulated run: the actuator's own, the fault, the conditions and those of every effect.

A run is a record of a NumPy structured array, so that thousands of runs are one array and the compiled simulation reads
fields by name. The field of parameter ``a`` of effect ``stribeck`` is ``stribeck_a``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import lru_cache
from typing import Any

import numpy as np

from ..effects import EFFECTS
from ..errors import InputError
from ..nominal import ActuatorParameters
from .grammar import OF_SHAPE, OF_WINDING, ORDERS, PHASES, of_recording

ECCENTRICITY_LAWS = ("stator_fixed", "rotor_angle", "rotor_angle_per_phase")


_CONDITIONS = (
    ("shorted_turns", np.float64, (3,)),  # N_j
    ("eccentricity", np.float64, (2,)),  # xi_x, xi_y
    ("dT", np.float64),  # winding at the start, K above the reference temperature; also the ambient
    ("dT_magnet", np.float64),  # magnets, K above the reference temperature
    ("eccentricity_law", np.int64),
    ("theta_0", np.float64),  # rotor angle at the start, rad
    ("emf_harmonics", np.float64, (len(ORDERS),)),  # of the back-EMF's shape, by order, beside those of an effect
    ("back_emf_share", np.float64, (3,)),  # by which a phase's coefficient differs from what its turns make of all's
    ("inductance_share", np.float64, (3,)),
)

RUN_DTYPE = np.dtype(
    [(f.name, np.float64) for f in fields(ActuatorParameters)]
    + list(_CONDITIONS)
    + [(effect.field(name), np.float64) for effect in EFFECTS.values() for name in effect.parameters]
)


def make_runs(
    actuator: ActuatorParameters,
    faults: np.ndarray,
    *,
    effects: Mapping[str, Mapping[str, Any]] | None = None,
    eccentricity_law: str = "stator_fixed",
    dT_magnet: np.ndarray | float | None = None,
    theta_0: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Build the records of a batch of runs.

    Parameters
    ----------
    actuator : nominal parameters
    faults : (run, 6) fault vectors
    effects : effect id -> parameter -> value (SI; a scalar or one value a run); what is not named stays off. A unit's
        tolerances are values of the calibration effects.
    dT_magnet : K above the reference temperature; None puts the magnets at the winding's temperature

    Returns
    -------
    (run,) structured array of ``RUN_DTYPE``

    Raises
    ------
    InputError : an unknown effect, parameter or eccentricity law
    """
    faults = np.atleast_2d(np.asarray(faults, float))
    runs = np.repeat(_nominal_run(actuator), len(faults))
    runs["shorted_turns"], runs["eccentricity"], runs["dT"] = faults[:, :3], faults[:, 3:5], faults[:, 5]
    runs["dT_magnet"] = faults[:, 5] if dT_magnet is None else dT_magnet
    if eccentricity_law not in ECCENTRICITY_LAWS:
        raise InputError(f"eccentricity_law: got '{eccentricity_law}', accepted are {', '.join(ECCENTRICITY_LAWS)}")
    runs["eccentricity_law"] = ECCENTRICITY_LAWS.index(eccentricity_law)
    runs["theta_0"] = theta_0
    set_effects(runs, effects or {})
    return runs


@lru_cache(maxsize=16)
def _nominal_run(actuator: ActuatorParameters) -> np.ndarray:
    """(1,) record of an actuator with every effect off."""
    run = np.zeros(1, RUN_DTYPE)
    for f in fields(actuator):
        run[f.name] = getattr(actuator, f.name)
    for effect in EFFECTS.values():
        for name, parameter in effect.parameters.items():
            run[effect.field(name)] = getattr(actuator, parameter.follows) if parameter.follows else parameter.nominal
    return run


def set_effects(runs: np.ndarray, effects: Mapping[str, Mapping[str, Any]]) -> None:
    """Write effect parameters into existing records, in place.

    Raises
    ------
    InputError : an unknown effect or parameter, naming what is accepted
    """
    for effect_id, values in effects.items():
        if effect_id not in EFFECTS:
            raise InputError(f"effects: '{effect_id}' is not known, accepted are {', '.join(EFFECTS)}")
        effect = EFFECTS[effect_id]
        for name, value in values.items():
            if name not in effect.parameters:
                accepted = ", ".join(effect.parameters)
                raise InputError(f"effects.{effect_id}: '{name}' is not known, accepted are {accepted}")
            runs[effect.field(name)] = value


def with_coefficients(runs: np.ndarray, entries: Sequence[Mapping[str, Any]], recording: str = "") -> np.ndarray:
    """(run,) records with the harmonics of the back-EMF's shape and the coefficients of single phases that entries of
    ``unlisted`` have; of a recording that is replayed, by its name."""
    out = runs.copy()
    for e in (of_recording(e, recording) for e in entries):
        if e["form"] in OF_SHAPE:
            out["emf_harmonics"] += [e.get(name, 0.0) for name in OF_SHAPE[e["form"]]]
        for full in OF_WINDING.get(e["form"], ()):
            name, _, phase = full.rpartition("_")
            out[f"{name}_share"][:, PHASES.index(phase)] += e.get(full, 0.0)
    return out
