"""The measuring chain's part of what no catalogue lists: forms that change what is recorded and nothing else.

Order: what a shape adds to a channel, the channel's curve, the drop of an inverter's switches, crosstalk, what a
current's channel picks up of its phase's voltage, lag, filter or average, a clock of its own, and drift; the sensors'
noise; then spikes, held samples, a channel slower than the recording, clipping and the converter's steps.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..delays import averaged, butterworth, filtered, smoothed
from ..resampled import before
from ..switches import direction
from .grammar import CONTROLLER, FACTORS, IN_RUN, LOGGERS, MACHINE, PHASES, SHAPES, of_recording
from .motor import AXIS, trapezoid
from .unlisted import PLACES, drawn_phase, followed, row_of

Signals = dict[str, np.ndarray]
#: quantity of a channel -> signals that it records
RECORDED = {
    "voltage": ("phase_voltage",), "current": ("phase_current", "phase_current_end"), "speed": ("rotor_speed",),
    "angle": ("rotor_angle",), "output": ("output_position",), "bus": ("bus_voltage",),
}  # fmt: skip
RECORDED |= {of: tuple(n for c in channels for n in RECORDED[c]) for of, channels in LOGGERS.items()}
#: of a channel that comes late: by a share of an interval, by exponential smoothing, behind an analogue filter, by an
#: average over samples
LATE = ("lag", "smoothing", "low_pass", "butterworth", "averaging")
THROUGH = {"smoothing": smoothed, "low_pass": filtered, "butterworth": butterworth}  # by their delay
AFTER_NOISE = ("spikes", "held", "hold", "clipping", "adc_step")
#: of the forms, shapes first
ORDER = ("", "gain", "sensor_curve", "drop", "crosstalk", "pickup", *LATE, "clock", "drift", *AFTER_NOISE)
PARTS = 8  # of an interval, over which the shape of the back-EMF is averaged


class Chain:
    """The entries of a configuration that lie in the measuring chain, for one run.

    Parameters
    ----------
    entries : as a configuration has them, checked
    run : record of RUN_DTYPE
    interval : of recording (s)
    seed, number : of the run; what is left to chance is drawn by them
    recording : name of the recording that is replayed, if any
    """

    def __init__(
        self,
        entries: Sequence[Mapping[str, Any]],
        run: np.void,
        interval: float,
        seed: int,
        number: int,
        recording: str,
    ):
        mine = [of_recording(e, recording) for e in entries if e["place"] not in MACHINE | IN_RUN | CONTROLLER]
        self.entries = sorted(mine, key=lambda e: ORDER.index("" if e["form"] in SHAPES else e["form"]))
        self.run, self.interval, self.seed, self.number = run, interval, seed, number

    def before_noise(self, signals: Signals) -> None:
        """Change the signals of the run, (time,) or (time, phase) each, in place."""
        true = {name: x.copy() for name, x in signals.items()}
        for m, entry in enumerate(self.entries):
            if entry["form"] in SHAPES:
                self._add(signals, true, entry, m)
            elif entry["form"] == "crosstalk":
                source = f"{entry['place'].partition('_')[0]}_{entry['source']}"
                for x, y in zip(_channels(signals, entry["place"]), _channels(true, source), strict=True):
                    x += entry["gain"] * y
            elif entry["form"] == "pickup":
                voltage = entry["place"].replace("current", "voltage")
                for x in _channels(signals, entry["place"]):
                    x += entry["gain"] * _channels(true, voltage)[0]
            elif entry["form"] == "drop":
                current = entry["place"].replace("voltage", "current")
                (x,), (i, *_) = _channels(signals, entry["place"]), _channels(true, current)
                x += entry["drop"] * direction(i, entry["turn"])
            elif entry["form"] == "clock":
                rng = np.random.default_rng([self.seed, 7, self.number])
                for x in _channels(signals, entry["place"]):
                    late = entry.get("late", 0.0) + entry.get("rate", 0.0) * np.arange(1.0, len(x) + 1.0)
                    scatter = entry.get("scatter", 0.0) / self.interval * rng.standard_normal(len(x))
                    x[...] = before(x, late + scatter)
            elif entry["form"] not in AFTER_NOISE:
                for x in _channels(signals, entry["place"]):
                    self._change(x, entry)

    def after_noise(self, signals: Signals) -> None:
        """The same of what happens to samples as they are taken."""
        rng = np.random.default_rng([self.seed, 6, self.number])
        for entry in self.entries:
            if entry["form"] in ("spikes", "held"):
                # the mean alone, where there is the end's current too
                _single_samples(_channels(signals, entry["place"])[0], entry, rng)
            elif entry["form"] in AFTER_NOISE:
                for x in _channels(signals, entry["place"]):
                    if entry["form"] == "clipping":
                        np.clip(x, -entry["level"], entry["level"], out=x)
                    elif entry["form"] == "hold":
                        every = int(entry["every"])
                        x[...] = x[np.arange(len(x)) // every * every]
                    else:
                        x[...] = entry["step"] * np.round(x / entry["step"])

    def _add(self, signals: Signals, true: Signals, entry: Mapping[str, Any], m: int) -> None:
        """A shape in a channel, or one that multiplies a signal."""
        place = entry["place"]
        if entry["form"] == "frequency" and "phase" not in entry:
            entry = dict(entry) | {"phase": drawn_phase(self.seed, self.number, 100 + m)}
        row = row_of(entry, PLACES[0])
        x = self._along(row, true, 0.5)
        quantity, phase = place.rsplit("_", 1) if place[-2:] in ("_a", "_b", "_c") else (place, "")
        if place not in FACTORS:
            for n, channel in enumerate(_channels(signals, place)):
                value = self._along(row, true, 1.0) if n or quantity in ("angle", "output") else x
                channel += value[:, None] if channel.ndim == 2 else value
        elif quantity == "speed_scale":
            signals["rotor_speed"] += x * true["rotor_speed"]
        elif quantity == "current_gain":
            for name in RECORDED["current"]:
                if name in signals:
                    signals[name][:, PHASES.index(phase)] += x * true[name][:, PHASES.index(phase)]
        elif quantity == "voltage_per_speed":
            j = PHASES.index(phase)
            signals["phase_voltage"][:, j] += x * self._swept(true, j)
        elif quantity == "output_play":
            signals["output_position"] += x * np.sign(true["rotor_speed"])
        else:
            signals["output_position"] += x * np.gradient(true["rotor_speed"], self.interval)

    def _along(self, row: np.ndarray, true: Signals, part: float) -> np.ndarray:
        """(time,) a term in each interval, after a part of it."""
        p, theta = self.run, true["rotor_angle"]
        before = np.concatenate([[p["theta_0"]], theta[:-1]])
        at = before + part * (theta - before)
        time = (np.arange(len(theta)) + part) * self.interval
        current = 0.5 * np.abs(true["phase_current"]).sum(axis=1)
        turned = (at - p["theta_0"]) / p["gear_ratio"]
        ambient = float(p["reference_temperature"] + p["dT"])
        return followed(row, time, at, np.ascontiguousarray(true["rotor_speed"]), current, turned, ambient)

    def _swept(self, true: Signals, j: int) -> np.ndarray:
        """(time,) mean of speed times the trapezoid of phase j (rad/s)."""
        p, theta = self.run, true["rotor_angle"]
        before = np.concatenate([[p["theta_0"]], theta[:-1]])
        ramp = 0.5 * (np.pi - np.deg2rad(p["back_emf_shape_width"]))
        parts = (np.arange(PARTS) + 0.5) / PARTS
        angles = before[:, None] + parts * (theta - before)[:, None]
        shape = [[trapezoid(p["pole_pairs"] * x - AXIS[j], ramp)[0] for x in row] for row in angles]
        return np.mean(shape, axis=1) * true["rotor_speed"]

    def _change(self, x: np.ndarray, entry: Mapping[str, Any]) -> None:
        """Curve, gain, lag, filter or drift of a channel (time,) or (time, phase), in place."""
        form, quantity = entry["form"], entry["place"].partition("_")[0]
        share = (np.arange(len(x)) + 0.5) / len(x)
        if form == "sensor_curve":
            full = self.run["current_limit"] if quantity == "current" else 0.5 * self.run["bus_voltage"]
            size = np.abs(x) - entry.get("dead", 0.0)
            bend = entry.get("bend", 0.0) * x * (x / full) ** 2
            x[...] = np.sign(x) * np.maximum(size, 0.0) + entry.get("halves", 0.0) * np.abs(x) - bend
        elif form == "lag":
            lag = entry["lag"]
            other = np.concatenate([x[:1], x[:-1]]) if lag > 0.0 else np.concatenate([x[1:], x[-1:]])
            x += abs(lag) * (other - x)
        elif form in THROUGH:
            x[...] = np.apply_along_axis(THROUGH[form], 0, x, entry["delay"])
        elif form == "averaging":
            x[...] = np.apply_along_axis(averaged, 0, x, 0.5 * (entry["samples"] - 1.0))
        elif form == "gain":
            gain = entry["gain"] + entry.get("growth", 0.0) * share
            x *= 1.0 + (gain[:, None] if x.ndim == 2 else gain)
        elif form == "drift":
            start = entry.get("at_start", 0.0)
            x += start + (entry["at_end"] - start) * share


def _channels(signals: Signals, place: str) -> list[np.ndarray]:
    """Views of the signals of a channel, the mean before the end's."""
    quantity, _, phase = place.partition("_")
    known = [signals[name] for name in RECORDED[quantity] if name in signals]
    return [x[:, PHASES.index(phase)] for x in known] if phase in PHASES else known


def _single_samples(x: np.ndarray, entry: Mapping[str, Any], rng: np.random.Generator) -> None:
    """Spikes of a standard deviation ``level``, or samples that repeat the one before, in a share of the samples."""
    hit = np.sort(rng.choice(np.arange(1, len(x)), round(entry["share"] * (len(x) - 1)), replace=False))
    if entry["form"] == "spikes":
        x[hit] += rng.normal(0.0, entry["level"], (len(hit), *x.shape[1:]))
    for k in hit if entry["form"] == "held" else ():
        x[k] = x[k - 1]
