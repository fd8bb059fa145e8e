"""Recordings with what was found in the measuring chain undone, as new files."""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..io.bench import new_folder
from ..io.motion import slips, without_slips, without_spikes_of_motion
from ..io.recording import Recording, write_recording
from ..io.sensors import without_spikes
from ..resampled import before
from ..switches import direction
from .acquisition import (
    CLOCKS,
    CURVES,
    GAIN_NAMES,
    RATE,
    clock_names,
    drifting,
    full_range,
    lost_by,
    picked_up,
    rates,
    undone,
)
from .coordinates import COEFFICIENTS
from .diagnose import Diagnosed
from .point import Point
from .position import SCALED
from .sensor_speed import SENSOR
from .telling_chain import channel_in_words

Undo = Callable[[Recording], Recording]
#: forms that a voltage of one phase has from its channel: nothing in the machine makes them
OF_THE_CHANNEL = ("frequency", "step_change", "pulse")


def corrected(found: Diagnosed, recordings: Mapping[str, Recording]) -> tuple[dict[str, Recording], list[str]]:
    """The recordings less the faults of their measuring chain, and what has been undone.

    Lag, clock, curve, drop, drift, gain, crosstalk, waves and jumps of a channel as the diagnosis has them; spikes of
    currents and motion are replaced by what their neighbours say, counts that the angle has lost are added. What cannot
    be undone (held samples, converter steps, clipping) stays.
    """
    out, undone = {}, dict[str, None]()
    for name, recording in recordings.items():
        for what, undo in _steps(found, name, len(recording.time), recording.interval):
            recording = undo(recording)
            undone[what] = None
        out[name] = recording
    return out, list(undone)


def _steps(found: Diagnosed, name: str, size: int, interval: float) -> Iterator[tuple[str, Undo]]:
    """What is to be undone in a recording, in words, and how."""
    told = {d["unit"] for d in found.verdict["discovered"]}
    values = found.values
    if "~spikes" in told:
        yield "spikes", _without_spikes
    if "~step_change" in told:
        yield "counts that the angle's encoder has lost", _with_all_counts
    for form in found.bench.described:
        of_voltage = form.equation.startswith("electrical_") and form.driver == 0 and form.word in OF_THE_CHANNEL
        channel = form.channel or (f"voltage_{form.equation[-1]}" if of_voltage else "")
        if form.id in told and channel and channel not in COEFFICIENTS:
            own = np.array([values.get(n, 0.0) for n in form.names(name)])
            x = found.bench.machine.wrong(name, form.channel, {form: own})
            words = f"{form.word.replace('_', ' ')} of the {channel.replace('_', ' of phase ')} channel"
            yield words, partial(_less, channel=channel, x=x)
    for quantity in ("voltage", "current", "output", "speed", "angle", "bus_voltage"):
        late = [u for u in told if u == f"~lag_{quantity}" or u.startswith(f"~lag_{quantity}_")]
        if late:
            words = f"lag of the {', '.join(channel_in_words(u.removeprefix('~lag_')) for u in sorted(late))}"
            yield words, partial(_not_late, quantity=quantity, at=Point(values, name, ()))
    for of, channels in CLOCKS.items():
        if f"~clock_{of}" in told:
            start, rate = (values.get(n, 0.0) for n in clock_names(of, name))
            behind = start + rate * np.arange(1.0, size + 1.0)
            yield f"clock of the {of} logger", partial(_on_time, channels=channels, late=behind)
    for quantity in ("voltage", "current"):
        if f"~curve_{quantity}" in told:
            bends = {
                k: np.array([sum(values.get(f"{k}.{c}", 0.0) for c in (quantity, f"{quantity}_{j}")) for j in "abc"])
                for k in CURVES
            }
            full = full_range(found.bench.machine.actuator, quantity)
            words, turn = f"curve of the {quantity} channels", values["dead.turn"]
            yield words, partial(_straightened, quantity=quantity, bends=bends, full=full, turn=turn)
    if "~drop_voltage" in told:
        drops = np.array([sum(values.get(f"drop.{c}", 0.0) for c in ("voltage", f"voltage_{j}")) for j in "abc"])
        yield "drop of the switches", partial(_less_drop, drops=drops, turn=values["drop.turn"])
    for quantity in ("current", "voltage"):
        if f"~crosstalk_{quantity}" in told:
            gains = np.array([[values.get(f"crosstalk_{quantity}.{j}{q}", 0.0) for q in "abc"] for j in "abc"])
            if gains.any():
                yield f"crosstalk between the {quantity}s", partial(_without_crosstalk, quantity=quantity, gains=gains)
            shares = np.array([float(picked_up(Point(values, name, ()), j, 1.0).value) for j in "abc"])
            if quantity == "current" and shares.any():
                yield "pickup of the voltages by the currents", partial(_without_pickup, shares=shares)
    share = (np.arange(size) + 0.5) / size
    if "~ambient" in told:
        yield "ambient temperature", partial(_warmer, by=values.get(f"ambient.start@{name}", 0.0))
    for quantity in ("speed", "angle", "output", "bus_voltage"):
        if f"~drift_{quantity}" in told:
            x = _drifted(values, quantity, "all", name, share, size * interval)
            yield f"drift of the {quantity.replace('_', ' ')}", partial(_less, channel=quantity, x=x)
    if "~scale_output" in told:
        scale = 1.0 + sum(values.get(f"gain_output.{whose}", 0.0) for whose in SCALED)
        yield "scale of the output position", partial(_rescaled, scale=scale)
    for quantity in ("voltage", "current"):
        for phase in "abc":
            if f"~drift_{quantity}_{phase}" in told:
                x = _drifted(values, quantity, phase, name, share, size * interval)
                yield f"drift of the {quantity} of phase {phase}", partial(_less, channel=f"{quantity}_{phase}", x=x)
        if f"~gain_{quantity}" in told:
            gain, growth = (
                np.array([sum(values.get(f"{n}_{quantity}.{of}@{name}", 0.0) for of in ("all", j)) for j in "abc"])
                for n in GAIN_NAMES
            )
            gains = 1.0 + gain + growth * share[:, None]
            yield f"gain of the {quantity} channels", partial(_over, quantity=quantity, gains=gains)


def write_corrected(
    found: Diagnosed, recordings: Mapping[str, Recording], bench: str | Path, folder: str | Path
) -> list[str]:
    """Write the corrected recordings under their names into a new folder; returns what has been undone.

    Raises
    ------
    InputError : the folder is the bench's own, or holds files already
    """
    folder = new_folder(bench, folder, "--corrected")
    out, undone = corrected(found, recordings)
    for name, recording in out.items():
        write_recording(folder / name, recording)
    return undone


def _warmer(recording: Recording, by: float) -> Recording:
    return replace(recording, ambient_temperature=recording.ambient_temperature + by)


def _straightened(
    recording: Recording, quantity: str, bends: Mapping[str, np.ndarray], full: float, turn: float
) -> Recording:
    """``bends`` (phase,) by kind of curve, of a channel's range; ``turn`` of a dead band (A)."""
    names = ("phase_voltage",) if quantity == "voltage" else ("phase_current", "phase_current_end")
    old = {n: x for n in names if (x := getattr(recording, n)) is not None}
    lost = {n: sum(amount * lost_by(k, x, full, turn) for k, amount in bends.items()) for n, x in old.items()}
    return replace(recording, **{n: x + lost[n] for n, x in old.items()})


def _over(recording: Recording, quantity: str, gains: np.ndarray) -> Recording:
    """``gains`` (sample, phase) of a channel, recorded over true."""
    if quantity == "voltage":
        return replace(recording, phase_voltage=recording.phase_voltage / gains)
    return _currents(recording, lambda x: x / gains)


def _rescaled(recording: Recording, scale: float) -> Recording:
    return replace(recording, output_position=recording.output_position / scale)


def _less_drop(recording: Recording, drops: np.ndarray, turn: float) -> Recording:
    """``drops`` (phase,) what the voltages have too much (V)."""
    too_much = drops * direction(recording.phase_current, turn)
    return replace(recording, phase_voltage=recording.phase_voltage - too_much)


def _drifted(
    values: Mapping[str, float], quantity: str, phase: str, recording: str, share: np.ndarray, length: float
) -> np.ndarray:
    """(sample,) what a channel has too much, at a ``share`` of the recording and its ``length`` (s)."""
    always, start, grows = (values.get(f"{kind}_{quantity}.{phase}{at}", 0.0) for kind, at in drifting(recording))
    return always + start + (grows + length * values.get(f"{RATE}_{quantity}.{phase}", 0.0)) * share


def _less(recording: Recording, channel: str, x: np.ndarray) -> Recording:
    if channel == "speed":
        return replace(recording, rotor_speed=recording.rotor_speed - x)
    if channel == "angle":
        return replace(recording, rotor_angle=recording.rotor_angle - x)
    if channel == "output":
        return replace(recording, output_position=recording.output_position - x)
    if channel == "bus_voltage":
        bus = recording.bus_voltage
        return recording if bus is None else replace(recording, bus_voltage=bus - x)
    if channel == "voltage":
        return replace(recording, phase_voltage=recording.phase_voltage - x[:, None])
    quantity, phase = channel.split("_")
    off = np.outer(x, np.eye(3)["abc".index(phase)])
    if quantity == "voltage":
        return replace(recording, phase_voltage=recording.phase_voltage - off)
    end = recording.phase_current_end
    later = 0.5 * (off + np.vstack([off[1:], off[-1:]]))
    return replace(
        recording,
        phase_current=recording.phase_current - off,
        phase_current_end=None if end is None else end - later,
    )


def _not_late(recording: Recording, quantity: str, at: Point) -> Recording:
    def of(mean: np.ndarray, end: np.ndarray | None = None, phase: str = "") -> list[np.ndarray]:
        known = zip([x for x in (mean, end) if x is not None], rates(mean, end), strict=False)
        return [np.asarray(undone(at, quantity, x, r, phase).value) for x, r in known]

    if quantity == "output":
        return replace(recording, output_position=of(recording.output_position)[0])
    if quantity == "speed":
        speed = of(recording.rotor_speed)[0]
        return replace(recording, rotor_speed=np.asarray(undone(at, SENSOR, speed, rates(speed, None)[0]).value))
    if quantity == "angle":
        return replace(recording, rotor_angle=of(recording.rotor_angle)[0])
    if quantity == "bus_voltage":
        bus = recording.bus_voltage
        return recording if bus is None else replace(recording, bus_voltage=of(bus)[0])
    if quantity == "voltage":
        voltages = zip("abc", recording.phase_voltage.T, strict=True)
        return replace(recording, phase_voltage=np.column_stack([of(x, phase=j)[0] for j, x in voltages]))
    ends = recording.phase_current_end
    phases = [of(x, None if ends is None else ends[:, j], "abc"[j]) for j, x in enumerate(recording.phase_current.T)]
    means, *at_end = (np.column_stack(x) for x in zip(*phases, strict=True))
    return replace(recording, phase_current=means, phase_current_end=at_end[0] if at_end else None)


def _on_time(recording: Recording, channels: Collection[str], late: np.ndarray) -> Recording:
    """``late`` (sample,) intervals by which the channels' logger is."""
    names = {"angle": "rotor_angle", "output": "output_position", "speed": "rotor_speed"}
    signals: dict[str, Any] = {names[c]: before(getattr(recording, names[c]), -late) for c in channels}
    return replace(recording, **signals)


def _without_crosstalk(recording: Recording, quantity: str, gains: np.ndarray) -> Recording:
    if quantity == "voltage":
        return replace(recording, phase_voltage=recording.phase_voltage - recording.phase_voltage @ gains.T)
    return _currents(recording, lambda x: x - x @ gains.T)


def _without_pickup(recording: Recording, shares: np.ndarray) -> Recording:
    """``shares`` (phase,) of its voltage that each current's channel picks up (A/V)."""
    return _currents(recording, lambda x: x - shares * recording.phase_voltage)


def _currents(recording: Recording, of: Callable[[np.ndarray], np.ndarray]) -> Recording:
    end = recording.phase_current_end
    return replace(
        recording, phase_current=of(recording.phase_current), phase_current_end=None if end is None else of(end)
    )


def _without_spikes(recording: Recording) -> Recording:
    calm = without_spikes_of_motion(recording)
    return replace(calm, phase_current=without_spikes(recording.phase_current)[0])


def _with_all_counts(recording: Recording) -> Recording:
    return replace(
        recording, rotor_angle=without_slips(recording.rotor_angle, *slips(without_spikes_of_motion(recording)))
    )
