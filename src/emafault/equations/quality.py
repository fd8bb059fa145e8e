"""What recordings show of their measuring chain without a model: clipping, steps, held samples, spikes, lost counts."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import binary_dilation

from ..actuator.grammar import EACH
from ..io.currents_noise import adds_up, resting_noise
from ..io.lattice import lattice_step
from ..io.motion import MOTION, slips, without_outliers, without_spikes_of_motion
from ..io.recording import Recording
from ..io.sensors import FEWEST_SPIKES, cut_off, spikes
from ..io.updates import repeated, updates
from .signals import MAY_BE_SLOWER

#: variable -> equation, words, unit, and place in a configuration's ``unlisted``
CHANNELS = {
    "phase_current": ("sensor_current", "current", "A", "current"),
    "phase_voltage": ("sensor_voltage", "voltage", "V", "voltage"),
    "bus_voltage": ("bus", "bus voltage", "V", "bus_voltage"),
    "output_position": ("position", "output position", "rad", "output"),
    "rotor_speed": ("sensor_speed", "speed", "rad/s", "speed"),
    "rotor_angle": ("sensor_angle", "angle", "rad", "angle"),
}
#: channels whose steps are an effect of the catalogue, or an encoder's counts
BY_STEPS = {"rotor_speed": "speed_quantisation", "rotor_angle": None}
ROWS = 12  # recordings in the picture of their quality
SUMMED = ("phase_current", "bus_voltage")
CERTAIN = 0.999  # of what is counted and not inferred


@dataclass(frozen=True)
class Channel:
    """What a channel of a recording shows by itself.

    ``noise``: standard deviation, robust, from third differences, in which the motion hardly shows, but for the
    inverter's ripple in the voltages; ``step``: of its
    converter, 0 where there is none to be seen; ``held``, ``spikes``, ``clipped``: shares of its samples; ``level``: at
    which it is cut off; ``every``: samples from one that is new to the next, of a channel slower than the recording;
    ``scatter``: standard deviation of the instants at which it is sampled (s); ``jump``: the largest by which an angle
    has lost counts (rad), ``at`` when (s).
    """

    noise: float
    step: float = 0.0
    held: float = 0.0
    spikes: float = 0.0
    clipped: float = 0.0
    level: float = 0.0
    every: float = 0.0
    scatter: float = 0.0
    jump: float = 0.0
    at: float = 0.0


def seen(recording: Recording, lacking: Collection[str] = (), scatter: float = 0.0) -> dict[str, Channel]:
    """What the channels of a recording show, those that it has of ``CHANNELS``.

    Parameters
    ----------
    lacking : effects of the catalogue that the library at hand has not
    scatter : of the instants at which the angle is sampled (s), which all recordings together tell
    """
    out = {}
    cut = cut_off(recording)
    for channel in CHANNELS:
        values = getattr(recording, channel)
        if values is None:
            continue
        lost = cut.get(channel, np.zeros((len(values), 1), bool))
        every = 0.0
        if channel in MAY_BE_SLOWER.values() and not (new := updates(values)).all():
            values, lost, every = values[new], lost[new], float(round(1.0 / np.mean(new), 1))
        out[channel] = replace(_channel(values.reshape(len(values), -1), lost, channel in SUMMED), every=every)
        if channel in MOTION:
            found = len(without_outliers(values)[1])
            out[channel] = replace(out[channel], spikes=found / len(values) if found >= FEWEST_SPIKES else 0.0)
        if channel == "phase_current" and adds_up(recording) and np.isfinite(noise := resting_noise([recording])):
            out[channel] = replace(out[channel], noise=noise)
        if channel == "rotor_angle":
            jump, at = _largest_slip(recording)
            out[channel] = replace(out[channel], scatter=scatter, jump=jump, at=at)
        if channel in BY_STEPS and BY_STEPS[channel] not in lacking:
            out[channel] = replace(out[channel], step=0.0, held=0.0)
    return out


def _largest_slip(recording: Recording) -> tuple[float, float]:
    """Size (rad) and time (s) of the largest jump by which the angle has lost counts, both 0 where there is none."""
    rows, sizes = slips(without_spikes_of_motion(recording))
    k = int(np.argmax(np.abs(sizes))) if len(sizes) else -1
    return (float(sizes[k]), float(recording.time[rows[k]])) if len(sizes) else (0.0, 0.0)


def _channel(values: np.ndarray, lost: np.ndarray, summed: bool) -> Channel:
    clipped, level = 0.0, 0.0
    if lost.any():
        clipped, level = float(lost.any(axis=1).mean()), float(np.abs(values[lost]).max())
        values = values[~binary_dilation(lost.any(axis=1))]
    # what the three currents do together is no motion's doing
    together = values.sum(axis=1)
    noise = _noise(together) / np.sqrt(values.shape[1]) if summed else float(np.median([_noise(x) for x in values.T]))
    step = max(lattice_step(x) for x in values.T)
    if step > 0.0:  # which repeats samples, and stands out, by itself
        return Channel(noise, step, 0.0, 0.0, clipped, level)
    held = max(float(np.mean(repeated(x)[1:])) for x in values.T)
    rate = len(spikes(values)) / len(values) if summed and not held else 0.0
    return Channel(noise, 0.0, held, rate, clipped, level)


def told(quality: Mapping[str, Mapping[str, Channel]]) -> list[dict[str, Any]]:
    """Clipping, steps, held samples, spikes, scattered instants and lost counts as entries of ``discovered``.

    Parameters
    ----------
    quality : what is ``seen``, by recording
    """
    out = []
    for channel, (equation, words, units, place) in CHANNELS.items():
        mine = {name: channels[channel] for name, channels in quality.items() if channel in channels}
        for form, found, parameter, unit, text in (
            ("clipping", {n: c.level for n, c in mine.items() if c.clipped}, "level", units,
             "the {0} channel is cut off at {1:.3g} {2}"),
            ("adc_step", {n: c.step for n, c in mine.items()}, "step", units,
             "the {0} channel comes in steps of {1:.3g} {2}"),
            ("held", {n: c.held for n, c in mine.items()}, "share", "1",
             "the {0} channel repeats {3:.2g} % of its samples"),
            ("held", {n: c.every for n, c in mine.items()}, "every", "1",
             "the {0} channel is slower than the recording: one sample in {1:.3g} is new"),
            ("spikes", {n: c.spikes for n, c in mine.items()}, "share", "1",
             "the {0} channel has spikes in {3:.2g} % of its samples"),
            ("clock", {n: c.scatter for n, c in mine.items()}, "scatter", "s",
             "the {0} channel is sampled at instants that scatter by {1:.2g} s"),
            ("step_change", {n: c.jump for n, c in mine.items()}, "jump", units,
             "the {0} channel jumps by {1:.3g} {2} and stays there, as that of an encoder that loses counts"),
        ):  # fmt: skip
            found = {n: x for n, x in found.items() if x}
            if found:
                value = float(np.median(list(found.values())))
                entry = _entry(form, equation, words, parameter, value, unit, text, list(found))
                # how large spikes are is not told
                term = None if form == "spikes" else {"place": place, "form": form, parameter: float(f"{value:.8g}")}
                if parameter == "every" and term is not None:
                    term = {"place": place, "form": "hold", "every": max(2, round(value))}
                if form == "step_change" and term is not None:
                    own = {n: {"jump": mine[n].jump, "time": mine[n].at} for n in found}
                    term |= {"jump": 0.0, "time": 0.0, EACH: own}
                out.append(entry | {"term": term})
    return out


def at_a_glance(quality: Mapping[str, Mapping[str, Channel]]) -> dict[str, dict[str, dict[str, float]]]:
    """The same as the verdict file has it: recording -> channel -> its noise, and what else is not zero."""
    return {
        name: {
            channel: {k: v for k, v in asdict(found).items() if v or k == "noise"}
            for channel, found in channels.items()
        }
        for name, channels in quality.items()
    }


def _noise(x: np.ndarray) -> float:
    third = np.diff(x, 3)
    return float(np.median(np.abs(third - np.median(third))) / 0.6745 / np.sqrt(20.0)) if len(third) else 0.0


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


def in_cells(quality: Mapping[str, Mapping[str, Mapping[str, float]]]) -> tuple[list[str], list[str], list[list[dict]]]:
    """Rows, columns and cells of the picture of the recordings' quality, the worst recordings of many."""
    channels = [c for c in CHANNELS if any(c in q for q in quality.values())]
    most = {c: float(np.median([q[c]["noise"] for q in quality.values() if c in q])) for c in channels}
    rows = {name: [_cell(q.get(c), c, most[c]) for c in channels] for name, q in quality.items()}
    worst = sorted(rows, key=lambda n: (-sum(c["fault"] for c in rows[n]), -max(c["relative"] for c in rows[n])))
    shown = [n for n in rows if n in set(worst[:ROWS])]
    titles = [CHANNELS[c][1] for c in channels]
    return shown, titles, [rows[n] for n in shown]


def _cell(found: Mapping[str, float] | None, channel: str, most: float) -> dict[str, Any]:
    if found is None:
        return {"text": "not recorded", "relative": 1.0, "fault": False}
    units = CHANNELS[channel][2]
    faults = [
        text.format(100.0 * found[k] if share else found[k], units)
        for k, share, text in (
            ("clipped", True, "{0:.2g} % clipped"), ("held", True, "{0:.2g} % held"),
            ("spikes", True, "{0:.2g} % spikes"), ("step", False, "steps of {0:.2g} {1}"),
            ("every", False, "one sample in {0:.2g} is new"), ("scatter", False, "instants scatter by {0:.2g} s"),
            ("jump", False, "jumps by {0:.2g} {1}"),
        )
        if k in found
    ]  # fmt: skip
    noise = f"{found['noise']:.2g} {units}"
    relative = found["noise"] / most if most > 0.0 else 1.0
    return {"text": ", ".join(faults) or noise, "relative": relative, "fault": bool(faults)}
