"""The fault vector f = [Na, Nb, Nc, xi_x, xi_y, dT] and how fault vectors are sampled.

N_j is the fraction of shorted turns of phase j (1), xi the static eccentricity in cartesian form (1) and dT the
winding's deviation from 20 degC (K).
"""

import numpy as np

from .errors import InputError

FAULT_NAMES = ("Na", "Nb", "Nc", "xi_x", "xi_y", "dT")
#: the seed paper's worked example
WORKED_EXAMPLE = (0.0375, 0.0504, 0.0507, 0.0059, 2.8e-5, 4.0)


def sample_faults(
    runs: int,
    *,
    shorted_turns: tuple[float, float],
    eccentricity: tuple[float, float],
    temperature: tuple[float, float],
    scheme: str = "random",
    seed: int = 0,
) -> np.ndarray:
    """Draw fault vectors; eccentricity is drawn in polar form (radius, direction) and returned in cartesian form.

    Parameters
    ----------
    runs : number of fault vectors
    shorted_turns, eccentricity, temperature : (low, high) of N_j (1), of the radius |xi| (1) and of dT (K)
    scheme : ``random`` (the paper's) or ``sobol`` (scrambled Sobol sequence)

    Returns
    -------
    (run, 6) array in the order of ``FAULT_NAMES``

    Raises
    ------
    InputError : an unknown scheme or an empty range
    """
    ranges = {"shorted_turns": shorted_turns, "eccentricity": eccentricity, "temperature": temperature}
    for name, (low, high) in ranges.items():
        if not low <= high:
            raise InputError(f"faults.{name}: low {low} is above high {high}")
    if scheme == "random":
        unit = np.random.default_rng([seed, 0]).random((runs, 6))
    elif scheme == "sobol":
        from scipy.stats import qmc  # takes half a second that no other scheme needs

        power = max(0, int(np.ceil(np.log2(max(runs, 1)))))
        unit = qmc.Sobol(6, rng=np.random.default_rng([seed, 1])).random_base2(power)[:runs]
    else:
        raise InputError(f"faults.scheme: got '{scheme}', accepted are random and sobol")
    out = np.empty((runs, 6))
    out[:, :3] = shorted_turns[0] + unit[:, :3] * (shorted_turns[1] - shorted_turns[0])
    radius = eccentricity[0] + unit[:, 3] * (eccentricity[1] - eccentricity[0])
    direction = np.pi * (1.0 - 2.0 * unit[:, 4])
    out[:, 3], out[:, 4] = radius * np.cos(direction), radius * np.sin(direction)
    out[:, 5] = temperature[0] + unit[:, 5] * (temperature[1] - temperature[0])
    return out
