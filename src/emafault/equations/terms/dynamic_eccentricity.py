"""The back-EMF coefficient turns with the rotor: d cos(theta - alpha_j - psi)."""

import numpy as np

SENTENCE = "the rotor runs eccentrically (dynamic eccentricity)"
PARAMETERS = {"d_cos": (0.0, 0.0, 0.025), "d_sin": (0.0, 0.0, 0.025)}


def coefficient(p, rec, j):
    """Factor of k_j."""
    x, y = p("d_cos"), p("d_sin")
    if not (x.value or x.slopes or y.value or y.slopes):
        return 1.0
    return 1.0 + x * np.cos(rec.middle - rec.axis[j]) + y * np.sin(rec.middle - rec.axis[j])


def report(value, deviation):
    """Catalogue parameters from the fitted ones: name -> (value, standard deviation)."""
    x, y = value["d_cos"], value["d_sin"]
    sx, sy = deviation["d_cos"], deviation["d_sin"]
    d = max(float(np.hypot(x, y)), 1e-12)
    return {
        "d": (d, float(np.hypot(x * sx, y * sy)) / d),
        "psi": (float(np.arctan2(y, x)), min(float(np.hypot(y * sx, x * sy)) / d**2, np.pi / 1.645)),
    }
