"""The rotor's zero, R and k of one recording, with the trapezoid as the back-EMF's shape."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from ..errors import InputError
from .electrical import Windows, space_vector
from .voltages import swept

REACH = np.pi / 6.0  # about the zero of the fundamental, electrical rad
LARGEST_ERROR = np.deg2rad(5.0)  # electrical; an offset of more is no effect of the catalogue any more


@dataclass(frozen=True)
class Electrical:
    """Resistance (ohm), inductance (H), k (V s/rad), zero (electrical rad, to be added) and its standard error."""

    resistance: float
    inductance: float
    back_emf: float
    zero: float
    error: float
    misfit: float  # V^2
    margin: float  # misfit without the back-EMF over that with it


def fit(name: str, w: Windows, part: np.ndarray, pole_pairs: int) -> Electrical:
    """Fit R, L, k and the rotor's zero to windows in which everything else is right.

    Parameters
    ----------
    part : (window, 3) phase voltages but for a common part (V)

    Raises
    ------
    InputError : a motion that leaves the zero open
    """
    h = np.diff(w.edges)[:, None]
    v, i = space_vector(part), space_vector(w.current)
    rate = np.diff(space_vector(w.current_edge)) / h[:, 0]

    def at(zero: float) -> tuple[float, np.ndarray, np.ndarray]:
        turned = space_vector(swept(pole_pairs * w.angle_edge + zero) / pole_pairs / h)
        columns = np.stack([np.concatenate([c.real, c.imag]) for c in (i, rate, turned)], axis=1)
        rhs = np.concatenate([v.real, v.imag])
        solution = np.linalg.lstsq(columns, rhs, rcond=None)[0]
        return float(np.mean((rhs - columns @ solution) ** 2)), solution, turned

    coarse = np.linspace(-np.pi, np.pi, 12, endpoint=False)
    start = min(coarse, key=lambda z: (at(z)[1][2] < 0.0, at(z)[0]))
    zero = minimize_scalar(lambda z: at(z)[0], bounds=(start - REACH, start + REACH), method="bounded").x
    misfit, (r, l, k), turned = at(zero)
    seen = float(np.sum(np.abs(k * turned) ** 2))  # what a radian of the zero would change, squared
    error = float(np.sqrt(misfit / max(seen, 1e-30)))
    if not error < LARGEST_ERROR:
        raise InputError(
            f"{name}: the rotor's electrical zero is known to {np.rad2deg(error):.0f} degrees only; record a longer or "
            "faster motion, or say signals.rotor_angle.electrical_zero"
        )
    rest = np.stack([np.concatenate([c.real, c.imag]) for c in (i, rate)], axis=1)
    rhs = np.concatenate([v.real, v.imag])
    without = float(np.mean((rhs - rest @ np.linalg.lstsq(rest, rhs, rcond=None)[0]) ** 2))
    zero = float(np.angle(np.exp(1j * zero)))
    return Electrical(float(r), float(l), float(k), zero, error, misfit, without / max(misfit, 1e-12))
