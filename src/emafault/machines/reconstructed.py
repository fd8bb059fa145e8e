"""The seed paper's R and k on measured machines, with their bias against whatever else tells k."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..reconstruction.paper import fit_phase
from .recorded import dq_machine, six_step_bus
from .statement import Arrays

THRESHOLD = 0.5  # of k0, the paper's "close to zero"


@dataclass(frozen=True)
class Reconstructed:
    """R (ohm) and k (V s/rad) of one recording by the paper's recipe, from the signals named in ``source``.

    ``references`` holds k (V s/rad) from independent measurements, ``spread`` how far i/w varies (relative), without
    which R and k are not separated.
    """

    source: str
    R: float
    k: float
    samples: int
    spread: float
    references: Mapping[str, float]

    def bias(self, reference: str) -> float:
        """(k - reference)/reference."""
        return self.k / self.references[reference] - 1.0


def paper(source: str, V: np.ndarray, i: np.ndarray, w: np.ndarray, references: Mapping[str, float]) -> Reconstructed:
    """The paper's recipe on (sample,) voltage, current and speed; nominal values are guessed from their size."""
    k0 = 0.7 * float(np.max(np.abs(V / w)))
    R0 = 0.15 * float(np.max(np.abs(V)) / np.max(np.abs(i)))
    R, k, _, kept = fit_phase(V.copy(), i.copy(), w.copy(), R0, k0, THRESHOLD, 1.0)
    ratio = i / w
    return Reconstructed(
        source, float(R), float(k), int(kept), float(ratio.std() / abs(ratio.mean())), dict(references)
    )


def torque_constant(T: np.ndarray, i: np.ndarray) -> float:
    """k of T = k i - T_0, least squares with a constant (V s/rad)."""
    slope, _ = np.polyfit(i, T, 1)
    return float(slope)


def reconstruct_measured(name: str, arrays: Arrays, nameplate: float | None = None) -> list[Reconstructed]:
    """R and k of one case of a machine that has voltage, current and speed; empty where it has not.

    Parameters
    ----------
    nameplate : speed constant (1/min per V) from the motor's plate, line to line, None if unknown
    """
    plate = {"nameplate": 60 / (2 * np.pi * nameplate)} if nameplate else {}
    if name == "propeller_sweep":
        w = arrays["speed_rpm"] * 2 * np.pi / 60
        return [paper("full throttle", arrays["v_bus_V"], arrays["i_bus_A"], w, plate)]
    if name == "dq_machine":
        rows = np.concatenate(dq_machine.steady_stretches(arrays))
        w = arrays["motor_speed"][rows] * 2 * np.pi / 60
        T, i_d, i_q = (arrays[key][rows] for key in ("torque", "i_d", "i_q"))
        # T = 3/2 (psi i_q + (L_d - L_q) i_d i_q)
        psi = float(np.linalg.lstsq(np.column_stack([i_q, i_d * i_q]), T, rcond=None)[0][0]) / 1.5
        return [paper("u_q, i_q", arrays["u_q"][rows], i_q, w, {"torque": psi})]
    if name != "six_step_bus" or "duty" not in arrays:
        return []
    t, duty = arrays["t"], arrays["duty"]
    settled = np.zeros(t.size, bool)
    for s in six_step_bus.plateaus(arrays):
        settled[s] = t[s] > t[s.start] + six_step_bus.SETTLE
    rows = np.flatnonzero(settled & (duty >= six_step_bus.CONTINUOUS_DUTY - 1e-9) & (arrays["w"] > 0))
    found = []
    for source, v, i in (("first instrument", "v", "i"), ("second instrument", "v_second", "i_second")):
        if v in arrays and i in arrays:
            phase = arrays[i][rows] / duty[rows]
            references = dict(plate)
            if "T" in arrays:
                references["torque"] = torque_constant(arrays["T"][rows], phase)
            found.append(paper(source, duty[rows] * arrays[v][rows], phase, arrays["w"][rows], references))
    return found
