"""What recordings show of their measuring chain without a model: clipping, steps, held samples, spikes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation

from ..io.recording import Recording
from ..io.sensors import cut_off
from .signals import lattice_step

CHANNELS = {
    "phase_current": ("sensor_current", "current", "A"),
    "phase_voltage": ("sensor_voltage", "voltage", "V"),
    "bus_voltage": ("bus", "bus voltage", "V"),
    "output_position": ("position", "output position", "rad"),
}
CERTAIN = 0.999  # of what is counted and not inferred
HELD = 3  # samples equal to the one before, which a channel with noise never shows
SPIKE = 10.0  # robust standard deviations of a second difference
FEWEST = 3  # spikes in a recording


def told(recordings: Mapping[str, Recording]) -> list[dict[str, Any]]:
    """Clipping, steps, held samples and spikes as entries of ``discovered``."""
    out = []
    cut = {name: cut_off(recording) for name, recording in recordings.items()}
    for channel, (equation, words, units) in CHANNELS.items():
        steps, held, spikes, clipped = {}, {}, {}, {}
        for name, recording in recordings.items():
            values = getattr(recording, channel)
            if values is None:
                continue
            lost = cut[name].get(channel, np.zeros(1, bool))
            if lost.any():
                clipped[name] = float(np.abs(values[lost]).max())
                values = values[~binary_dilation(lost.any(axis=1))]
            columns = values.reshape(len(values), -1).T
            step = max(lattice_step(x) for x in columns)
            if step > 0.0:
                steps[name] = step
                continue
            repeated = max(_repeated(x) for x in columns)
            if repeated:
                held[name] = repeated
            if channel in ("phase_current", "bus_voltage"):
                # what the three currents do together is no motion's doing
                rate = _spiked(columns.sum(axis=0))
                if rate:
                    spikes[name] = rate
        for form, found, parameter, unit, text in (
            ("clipping", clipped, "level", units, "the {0} channel is cut off at {1:.3g} {2}"),
            ("adc_step", steps, "step", units, "the {0} channel comes in steps of {1:.3g} {2}"),
            ("held", held, "share", "1", "the {0} channel repeats {3:.2g} % of its samples"),
            ("spikes", spikes, "share", "1", "the {0} channel has spikes in {3:.2g} % of its samples"),
        ):
            if found:
                value = float(np.median(list(found.values())))
                out.append(_entry(form, equation, words, parameter, value, unit, text, list(found)))
    return out


def _repeated(x: np.ndarray) -> float:
    """Share of the samples equal to the one before, where the channel moves otherwise."""
    same = np.diff(x) == 0.0
    return float(same.mean()) if HELD <= same.sum() < 0.5 * len(same) else 0.0


def _spiked(x: np.ndarray) -> float:
    """Share of single samples that stand out of their neighbours."""
    lone = spiked(x)
    return float(lone.mean()) if lone.sum() >= FEWEST else 0.0


def spiked(x: np.ndarray) -> np.ndarray:
    """(sample less 2,) which samples but the first and the last stand out of their neighbours by themselves."""
    bend = x[1:-1] - 0.5 * (x[:-2] + x[2:])
    scale = np.median(np.abs(bend)) / 0.6745
    out = np.abs(bend) > SPIKE * scale if scale > 0.0 else np.zeros(len(bend), bool)
    return out & (np.abs(bend) >= np.abs(np.roll(bend, 1))) & (np.abs(bend) >= np.abs(np.roll(bend, -1)))


def _entry(
    form: str, equation: str, words: str, parameter: str, value: float, units: str, text: str, names: Sequence[str]
) -> dict[str, Any]:
    sentence = "In the measuring chain " + text.format(words, value, units, 100.0 * value) + "."
    return {
        "unit": f"~{form}", "equation": equation, "along": "time", "form": form, "probability": CERTAIN, "closed": None,
        "another_form_of": None,
        "parameters": {parameter: {"value": value, "low": value, "high": value, "units": units}},
        "recordings": list(names), "sentence": sentence,
    }  # fmt: skip
