"""Reconstruction of phase resistances and back-EMF coefficients from recorded voltages, currents and speed."""

from collections.abc import Callable, Mapping

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .features import Features, Signals, join_features, read_signals

__all__ = ["METHODS", "Features", "join_features", "reconstruct"]

METHODS = ("paper", "weighted", "angle_resolved", "nine")


def _function(method: str) -> Callable[[Signals, ActuatorParameters, Mapping], Features]:
    """Function of a method; importing it takes longer than many a job that only reads features."""
    if method == "paper":
        from .paper import reconstruct_paper as function
    elif method == "weighted":
        from .weighted import reconstruct_weighted as function
    elif method == "angle_resolved":
        from .angle_resolved import reconstruct_angle_resolved as function
    else:
        from .nine import reconstruct_nine as function
    return function


def reconstruct(
    method: str, signals: Mapping[str, np.ndarray], interval: float, actuator: ActuatorParameters, settings: Mapping
) -> Features:
    """Reconstruct phase parameters from the recorded signals of a batch of runs.

    Parameters
    ----------
    method : one of ``METHODS``
    signals : name -> (run, time[, phase]) as recorded; ``phase_current_end`` may be absent
    interval : recording interval (s)
    actuator : nominal parameters, where weights and searches start
    settings : the method's own settings; what is not given keeps its default

    Raises
    ------
    InputError : an unknown method or setting, a missing signal, or a record that the method cannot use at all
    """
    if method not in METHODS:
        raise InputError(f"reconstruction.method: got '{method}', accepted are {', '.join(METHODS)}")
    features = _function(method)(read_signals(signals, interval), actuator, settings)
    if len(features.R) and not np.any(features.identified):
        raise InputError(
            f"reconstruction '{method}': no record determines R and k of all three phases; a motion of at least one "
            "electrical revolution with intervals shorter than a commutation sector is needed"
        )
    return features
