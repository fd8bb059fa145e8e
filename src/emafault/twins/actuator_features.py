"""The ladder of how far in features: R and k reconstructed from recordings and from what each model makes of them."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import InputError
from ..gap.diagnose import Diagnosis
from ..gap.how_far import PLACEBOS, closed
from ..reconstruction import reconstruct
from .actuator import ActuatorTwin
from .actuator_noise import CHANNELS

REPEATS = 3  # noisy copies of a simulated recording, averaged
METHOD, SETTINGS = "weighted", {"floating": True, "discard": 0.02}


def feature_ladder(diagnosis: Diagnosis) -> dict | None:
    """Root mean square of the whitened difference in R and k on the confirm recordings, as the verdict file has it.

    None without confirm recordings that determine R and k. The placebo is a random direction in R and k, the same in
    all recordings, whose size is fitted on the explore recordings.
    """
    ladder, twin = diagnosis.ladder, diagnosis.twin
    if ladder is None or not isinstance(twin, ActuatorTwin):
        return None
    rungs = {"nominal": ladder.nominal, "recalibrated": ladder.recalibrated, "after": ladder.after}
    found = {
        rung: _differences(twin, at.values, ladder.problem.part) for rung, at in rungs.items()
    }  # rung -> recording -> (6,) whitened
    names = [n for n in ladder.problem.part if all(n in by_name for by_name in found.values())]
    if not names:
        return None
    stacked = {rung: np.concatenate([by_name[n] for n in names]) for rung, by_name in found.items()}
    entry: dict[str, float | None] = {rung: _rms(values) for rung, values in stacked.items()}
    best = diagnosis.found.candidates[0] if ladder.after is not ladder.recalibrated else None
    count = len(best.point.free) - len(diagnosis.explore.nuisances) if best is not None else 0
    entry["placebo"] = entry["recalibrated"]
    if best is not None:
        explored = _differences(twin, diagnosis.found.null.values, diagnosis.explore.part)
        entry["placebo"] = _placebo(explored, {n: found["recalibrated"][n] for n in names}, max(1, count))
    entry["floor"] = 1.0
    share = closed(_rms(stacked["recalibrated"]), _rms(stacked["after"]), 1.0, len(stacked["after"]))
    order = ("nominal", "recalibrated", "placebo", "after", "floor")
    return {rung: entry[rung] for rung in order} | {"closed": share}


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _differences(twin: ActuatorTwin, values: np.ndarray, part: Sequence[str]) -> dict[str, np.ndarray]:
    """Recording -> (6,) R and k measured less simulated, whitened by their covariance; undetermined ones left out."""
    out = {}
    for name in part:
        brought = twin._brought[name]
        noise = {c: max(brought.noise[c], 1e-9) for c in ("voltage", "current", "current_end", "speed")}
        settings = SETTINGS | {"noise": noise}
        run = twin._runs(values[None, :], name)[0]
        clean = twin.simulated(name, [run])[0]
        rng = np.random.default_rng(3)
        simulated = {
            signal: np.stack(
                [clean[signal] + brought.noise[c] * rng.standard_normal(clean[signal].shape) for _ in range(REPEATS)]
            )
            for c, signal in CHANNELS.items()
            if signal in brought.signals
        }
        try:
            measured = reconstruct(METHOD, _kept(brought.signals), brought.nominal.interval, twin.actuator, settings)
            model = reconstruct(METHOD, _kept(simulated), brought.nominal.interval, twin.actuator, settings)
        except InputError:
            continue
        if not measured.identified[0] or not np.all(model.identified):
            continue
        difference = measured.six[0] - model.six.mean(0)
        covariance = measured.covariance[0] * (1.0 + 1.0 / REPEATS)
        out[name] = np.linalg.solve(np.linalg.cholesky(covariance), difference)
    return out


def _kept(signals: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    names = ("phase_voltage", "phase_current", "phase_current_end", "rotor_speed", "rotor_angle")
    return {n: signals[n] for n in names if n in signals}


def _placebo(explored: Mapping[str, np.ndarray], confirmed: Mapping[str, np.ndarray], count: int) -> float:
    """Median over random directions, fitted where explored, of the root mean square that they leave where confirmed."""
    rng = np.random.default_rng(20)
    out = []
    here, there = np.concatenate(list(explored.values())), np.concatenate(list(confirmed.values()))
    for _ in range(PLACEBOS):
        drawn = rng.standard_normal((6, min(count, 6)))
        design = np.tile(drawn, (len(explored), 1))
        amplitude, *_ = np.linalg.lstsq(design, here, rcond=None)
        out.append(_rms(there - np.tile(drawn, (len(confirmed), 1)) @ amplitude))
    return float(np.median(out))
