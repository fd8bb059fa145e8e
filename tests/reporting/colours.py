"""How far colours lie apart for full and for deficient colour vision, and contrasts as WCAG 2 defines them."""

import numpy as np
from matplotlib.colors import to_rgb

#: of linear RGB: Machado, Oliveira and Fernandes, IEEE TVCG 15(6), 2009, severity 1
SEEN = {
    "all cones": np.eye(3),
    "protanopia": [
        [0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900],
    ],
}  # fmt: skip
_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def _linear(colour):
    c = np.array(to_rgb(colour))
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def contrast(a, b):
    """Ratio of luminances, 1 to 21."""
    low, high = sorted(float(_XYZ[1] @ _linear(c)) + 0.05 for c in (a, b))
    return high / low


def apart(a, b, eye):
    """Distance in CIELAB (CIE 1976), of which about 2 is just noticed between large patches."""

    def lab(colour):
        t = _XYZ @ np.clip(np.array(SEEN[eye]) @ _linear(colour), 0.0, 1.0) / _XYZ.sum(axis=1)
        f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
        return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])

    return float(np.linalg.norm(lab(a) - lab(b)))
