"""The bound of a unit that is calibrated: the information of its healthy recordings beside that of the recording.

The healthy recordings bound the unit's R0 and k0 (and L0) at the reference temperature as the recording itself bounds
R and k: by the Cramer-Rao covariance of their own noise-free signals, with the error of the measured ambient
temperature and what is known of any unit beforehand (``calibrate``). That covariance is added to the
recording's, relative to each coefficient. Simulated healthy units are exactly healthy, which no estimator knows.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..actuator.simulate import simulate
from ..actuator.unlisted import in_machine
from ..closed_form import forward, inverse, jacobian, propagate
from ..dataset import sample_runs
from ..identification.posterior import Knowledge, nine_forward, nominal_nine, posterior
from ..reconstruction import Features
from ..reconstruction.bounds import cramer_rao_bound, nine_bound
from ..reconstruction.calibration import calibrate

SIX = ("plateau", "floating")  # bounds of six features


def coefficient_bound(
    name: str,
    clean: Mapping[str, np.ndarray],
    interval: float,
    actuator: ActuatorParameters,
    noise: Mapping[str, float],
    discard: float,
) -> np.ndarray:
    """Smallest covariance of R and k (run, 6, 6), or with L (run, 9, 9), of noise-free recordings.

    Parameters
    ----------
    name : ``plateau`` or ``floating`` samples for six, ``recording`` or ``heating`` for nine, as of ``compute_bound``
    clean, interval, noise : as of ``nine_bound``; discard : s at the start that are not used
    """
    if name in SIX:
        choice = {"discard": discard, "floating": name == "floating"}
        return cramer_rao_bound(clean, interval, actuator, noise, choice).features
    return nine_bound(clean, interval, actuator, noise, {"discard": discard, "heating": name == "heating"})


def least_of(
    covariance: np.ndarray,
    unit: np.ndarray,
    faults: np.ndarray,
    actuator: ActuatorParameters,
    alpha_m: float,
    known: Knowledge,
    dT_magnet: np.ndarray,
) -> np.ndarray:
    """(run, 6) smallest standard errors of faults.

    Parameters
    ----------
    covariance : (run, width, width) smallest of six or nine coefficients (SI)
    unit : (9, 9), (width, width) or (run, width, width) relative covariance to which the unit is known
    known : of which the lag is read
    """
    width = covariance.shape[2]
    true = nine_forward(faults, actuator, alpha_m, dT_magnet)[:, :width]
    whole = covariance + unit[..., :width, :width] * true[:, :, None] * true[:, None, :]
    if width == 6:
        # six features do not tell the lag, an error of which is one of the flux that the phases have in common
        flux = true[:, 3:] * (alpha_m * known.lag_deviation / (1.0 + alpha_m * dT_magnet))[:, None]
        whole[:, 3:, 3:] += flux[:, :, None] * flux[:, None, :]
        derivative = jacobian(lambda x: inverse(x[..., :3], x[..., 3:], actuator, alpha_m, known.lag), true)
        least = propagate(whole, derivative)
    else:
        least = posterior(true, whole, actuator, alpha_m, known).covariance
    return np.sqrt(np.diagonal(least, axis1=1, axis2=2))


class HealthyUnits:
    """What the healthy recordings of the first fresh units bound of them.

    Parameters
    ----------
    spec : the sub-tree ``config.bound_spec``, whose ``reference`` is read
    positions : (tick+1,) commanded user-shaft angle (rad)
    """

    def __init__(self, spec: Mapping[str, Any], positions: np.ndarray) -> None:
        self.spec, self.positions, part = spec, positions, spec["reference"]
        self.sample, self.each = sample_runs(part), part["recordings_of_a_unit"]
        self.actuator = ActuatorParameters(**part["actuator"])

    def covariances(self, units: slice, names: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Name of a bound -> (unit, width, width) relative covariance of R0 and k0, or with L0."""
        part, spec, actuator = self.spec["reference"], self.spec, self.actuator
        rows = slice(units.start * self.each, units.stop * self.each)
        recording = part["recording"]
        runs, terms = self.sample.records(rows), part.get("unlisted", ())
        unlisted = in_machine(terms, len(runs), part["seed"], rows.start)
        clean = simulate(runs, self.positions, recording["duration"], recording["interval"], terms=unlisted)
        return {
            name: self._relative(
                coefficient_bound(name, clean, recording["interval"], actuator, part["sensors"], spec["discard"]),
                self.sample.faults[rows],
            )
            for name in names
        }

    def _relative(self, covariance: np.ndarray, faults: np.ndarray) -> np.ndarray:
        actuator, width, alpha_m = self.actuator, covariance.shape[2], self.spec["magnet_coefficient"]
        nominal, known = nominal_nine(actuator), Knowledge(**self.spec["known"]).covariance()
        options = {"ambient_error": self.spec["ambient_error"], "alpha_m": alpha_m, "healthy_within": 0.0}
        if np.any(known):
            options["prior"] = nominal, known * np.outer(nominal, nominal)
        found = []
        for n in range(0, len(faults), self.each):
            own, noise = faults[n : n + self.each], covariance[n : n + self.each]
            R, k = forward(own, actuator, alpha_m)
            extras = {"nine_covariance": noise} if width == 9 else {}
            L = np.full(R.shape, actuator.inductance)
            features = Features(R, k, L, np.zeros(R.shape), noise[:, :6, :6], extras)
            ambient = actuator.reference_temperature + own[:, 5]
            found.append(calibrate(features, ambient, actuator, **options).covariance)
        return np.stack(found) / np.outer(nominal[:width], nominal[:width])
