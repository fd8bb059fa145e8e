"""From signals that have been put right to a recording: interval means, ends, the star point, noise."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from ..io.recording import PHASES, Recording
from ..units import quantity
from .loading import Raw
from .signal import Signal, pulse_uncertainty, pulses
from .voltages import phase_signals, swept, with_modelled_star
from .windows import span

GAP = 1.5  # of a step, between samples; from here on one is missing
WHOLE = 1e-3  # of an interval, by which a mean's sample may end beside an interval


def recording_of(
    raw: Raw, given: Mapping[str, Any], actuator: ActuatorParameters, interval: float, noise: float
) -> Recording:
    """Recording of a segment, at the interval asked for.

    Parameters
    ----------
    noise : of a mean voltage by the sensors themselves (V)

    Raises
    ------
    InputError : a segment beyond what was measured, a gap or missing value in it, or samples slower than intervals
    """
    first, last = _segment(raw)
    raw.change(lambda s: s.within(first, last))
    for signal in raw.signals():
        _check(raw, signal, interval)
    count = int((last - first) / interval + 1e-6)
    edges = first + interval * np.arange(count + 1)
    three = {name: phase_signals(raw, name) for name in raw.phased}
    means = {name: np.stack([s.means(edges) for s in signals], axis=1) for name, signals in three.items()}
    ends = _ends(raw, three, edges)
    angle = raw.single["rotor_angle"].at(edges)
    known: dict[str, dict[str, Any]] = {"rotor_angle": {"source": _source(given)}}
    if raw.zero_error > 0.0:
        known["rotor_angle"]["zero_error"] = raw.zero_error
    voltage = known["phase_voltage"] = {"reference": "star"}
    star = given["signals"]["phase_voltage"]["reference"]
    phase_voltage = means["phase_voltage"]
    if star != "star":
        voltage["reference"] = "modelled_star"
        rate = (
            np.gradient(means["phase_current"], interval, axis=0) if ends is None else np.diff(ends, axis=0) / interval
        )
        turned = swept(actuator.pole_pairs * angle) / actuator.pole_pairs / interval
        phase_voltage, misfit, _ = with_modelled_star(phase_voltage, means["phase_current"], rate, turned)
        raw.lost.append(
            f"the star point was not measured: it is modelled from the line voltages, missed by {misfit:.2g} V there; "
            "what moves the star point alone cannot be determined"
        )
    if raw.off is not None and raw.off.any():
        part = 0.5 * actuator.bus_voltage * three["phase_voltage"][0].step / interval
        raw.lost.append(
            f"where the current of a leg that is off runs out, a mean voltage is uncertain by up to {part:.2g} V"
        )
    uncertain = _pulsed(raw, given, three["phase_voltage"], interval)
    if uncertain > 0.0:
        voltage["noise"] = float(np.hypot(uncertain, noise))
    missing = [PHASES[k] for k, s in enumerate(given["signals"]["phase_current"]["channels"]) if s is None]
    if missing:
        known["phase_current"] = {"derived": " ".join(missing)}
    entry = raw.entry
    bus = raw.single.get("bus_voltage")
    if bus is None:
        raw.lost.append("no bus voltage: the supply is judged only where the motor leaves it no headroom")
    if "rotor_speed" not in raw.single:
        raw.lost.append(
            "no rotor_speed: it is the rate of rotor_angle, and a fault of a speed sensor cannot be detected"
        )
    speed = raw.single["rotor_speed"].means(edges) if "rotor_speed" in raw.single else np.diff(angle) / interval
    return Recording(
        time=interval * np.arange(1, count + 1),
        phase_voltage=phase_voltage,
        phase_current=means["phase_current"],
        phase_current_end=None if ends is None else ends[1:],
        rotor_speed=speed,
        rotor_angle=angle[1:],
        output_position=raw.single["output_position"].at(edges[1:]),
        commanded_position=raw.single["commanded_position"].at(edges[1:]),
        bus_voltage=None if bus is None else bus.means(edges),
        ambient_temperature=quantity(entry["ambient"], "degC", f"recordings.{raw.name}.ambient"),
        attributes={
            "health": entry["health"],
            "command": entry.get("command", "unknown"),
            "unit": given.get("unit", "unknown"),
        },
        known=known,
        name=f"{raw.name}.nc",
    )


def _segment(raw: Raw) -> tuple[float, float]:
    """From when to when (s), on the bench's clock."""
    first, last = span(raw)
    if "segment" not in raw.entry:
        return first, last
    a, b = (quantity(x, "s", f"recordings.{raw.name}.segment") for x in raw.entry["segment"])
    step = max(s.step for s in raw.signals())
    if not first - step <= a < b <= last + step:
        raise InputError(
            f"{raw.name}: the segment {a:g} to {b:g} s is not within {first:.6g} to {last:.6g} s, where all is known"
        )
    return max(a, first), min(b, last)


def _check(raw: Raw, signal: Signal, interval: float) -> None:
    bad = ~np.isfinite(signal.values)
    where = f"{raw.name}: {signal.name}"
    if bad.any():
        raise InputError(
            f"{where} has no value at {signal.time[int(np.argmax(bad))]:.6g} s; choose a segment beside it"
        )
    steps = np.diff(signal.time)
    if steps.max() > GAP * np.median(steps):
        at = signal.time[int(np.argmax(steps))]
        raise InputError(f"{where} has a gap of {1e3 * steps.max():.3g} ms at {at:.6g} s; choose a segment beside it")
    if signal.step > interval * (1.0 + WHOLE):
        raise InputError(f"{where} comes every {1e3 * signal.step:.4g} ms; ask for an interval of that or more")
    ratio = interval / signal.step
    if signal.averaged and abs(ratio - round(ratio)) > WHOLE * ratio:
        raw.lost.append(
            f"{signal.name}: means of {1e3 * signal.step:.4g} ms do not fill intervals; they are shared out"
        )


def _ends(raw: Raw, three: Mapping[str, list[Signal]], edges: np.ndarray) -> np.ndarray | None:
    """(edge, 3) currents at the edges, where instants of them were measured."""
    name = "phase_current_end" if "phase_current_end" in three else "phase_current"
    if any(s.averaged for s in three[name]):
        raw.lost.append("no end currents: inductances can be judged less well")
        return None
    return np.stack([s.at(edges) for s in three[name]], axis=1)


def _pulsed(raw: Raw, given: Mapping[str, Any], voltages: list[Signal], interval: float) -> float:
    """Standard deviation (V) of a mean of pulses that are known at samples only; the largest of the phases."""
    spec = given["signals"]["phase_voltage"]
    if any(s.averaged for s in voltages) or spec["reference"] == "duty":
        return 0.0
    worst = 0.0
    for signal in voltages:
        swing, frequency = pulses(signal)
        if "pwm_frequency" in spec:
            frequency = quantity(spec["pwm_frequency"], "Hz", "signals.phase_voltage.pwm_frequency")
            swing = float(np.ptp(np.quantile(signal.values, [0.005, 0.995])))
        worst = max(worst, pulse_uncertainty(swing, frequency, signal.step))
        said = f"{swing:.3g} V, {1e-3 * frequency:.3g} kHz at {1e-3 / signal.step:.4g} kS/s"
    if worst > 0.0:
        raw.lost.append(
            f"pulses of {said} are seen at samples only: a {1e6 * interval:.0f} us mean is uncertain by {worst:.2g} V"
        )
    return worst


def _source(given: Mapping[str, Any]) -> str:
    spec = given["signals"]["rotor_angle"]
    return "hall" if "hall" in spec else spec.get("source", "encoder")
