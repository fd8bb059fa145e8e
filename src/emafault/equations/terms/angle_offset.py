"""The measured rotor angle is off; the commutation sees it too."""

import numpy as np

SENTENCE = "the rotor angle is measured with an offset"


def angle(p):
    """Electrical rad by which the measured angle is ahead."""
    return p("offset") * (np.pi / 180.0)
