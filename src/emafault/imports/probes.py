"""Probes put right: decades and signs of voltages, currents and bus, by each other and the nominal actuator."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .electrical import sharp_misfits
from .finding import Finding, decided
from .loading import Raw
from .scales import DECADES, nearest, sum_test
from .signal import pulses
from .voltages import phase_signals
from .windows import windows_of

LETTERS = "abc"
CURRENTS = ("phase_current", "phase_current_end")
PER_PULSE = 8  # samples in a pulse's period: jumps at random, of pulses that samples miss, look like some four
Given = Mapping[str, Any]


def refuse_missed_pulses(recordings: Sequence[Raw], given: Given) -> None:
    """Refuse voltages that jump from sample to sample: nothing shows how fast their pulses come.

    Raises
    ------
    InputError : samples at instants that are too few in a pulse's period, whose frequency the map does not say
    """
    if "pwm_frequency" in given["signals"]["phase_voltage"]:
        return
    for raw in recordings:
        for signal in _three(raw, "phase_voltage"):
            if pulses(signal)[1] * signal.step > 1.0 / PER_PULSE:
                raise InputError(
                    f"{raw.name}: phase_voltage jumps from sample to sample, its pulses come faster than samples show; "
                    "say signals.phase_voltage.pwm_frequency, or samples: means if each is one"
                )


def check_probes(recordings: Sequence[Raw], given: Given) -> list[Finding]:
    """Decades of voltage probes against each other, signs and decades of currents by their sum; put right in place.

    Raises
    ------
    InputError : a decade or sign that the map says otherwise, or that the data leave open
    """
    out = []
    spec = given["signals"]["phase_voltage"]
    if spec["reference"] != "duty":
        rms = np.sqrt(np.mean([[np.var(s.values) for s in _three(r, "phase_voltage")] for r in recordings], axis=0))
        for k, size in enumerate(rms):
            ratio = size / float(np.median(rms))
            factor, finding = nearest(f"phase_voltage {LETTERS[k]} beside the others", max(ratio, 1e-12), DECADES)
            decided(finding, "say signals.phase_voltage.scale")
            if factor != 1.0:
                refuse_stated(spec, "phase_voltage", "scale", finding)
                scale(recordings, ("phase_voltage",), np.where(np.arange(3) == k, 1.0 / factor, 1.0))
                out.append(finding)
    spec = given["signals"]["phase_current"]
    if None not in spec["channels"]:
        spans = [(r, _common(r)) for r in recordings]
        factors, finding = sum_test([np.stack([s.at(t) for s in _three(r, "phase_current")], axis=1) for r, t in spans])
        out.append(decided(finding, "say signals.phase_current.sign and scale"))
        for key, changed in (("sign", (factors < 0.0).any()), ("scale", (np.abs(factors) != 1.0).any())):
            if changed:
                refuse_stated(spec, "phase_current", key, finding)
        scale(recordings, CURRENTS, factors)
    return out


def _three(raw: Raw, name: str):
    return [s for s in raw.phased[name] if s is not None]


def _common(raw: Raw) -> np.ndarray:
    signals = _three(raw, "phase_current")
    step = max(s.step for s in signals)
    return np.arange(max(s.begin for s in signals), min(s.end for s in signals), step)


def check_pair(
    recordings: Sequence[Raw], given: Given, actuator: ActuatorParameters, star: Callable, interval: float
) -> list[Finding]:
    """Of two currents, sign and decade of the second beside the first by the voltage equation, and the third; in place.

    Raises
    ------
    InputError : a sign or decade that the map says otherwise, or that the data leave open
    """
    spec = given["signals"]["phase_current"]
    if None not in spec["channels"]:
        return []
    k = max(k for k in range(3) if recordings[0].phased["phase_current"][k] is not None)
    measured = [list(raw.phased["phase_current"]) for raw in recordings]

    def put(factor: float) -> None:
        for raw, three in zip(recordings, measured, strict=True):
            raw.phased["phase_current"] = [s if n != k or s is None else s.scaled(factor) for n, s in enumerate(three)]
            raw.phased["phase_current"] = list(phase_signals(raw, "phase_current"))

    for raw in recordings:
        raw.lost.append("the third current is less the sum of the two measured: no sum shows an error of either")
    if "sign" in spec and "scale" in spec:
        put(1.0)
        return []
    tried = {}
    for factor in (1.0, -1.0, 10.0, -10.0, 0.1, -0.1):
        put(factor)
        windows = [w for raw in recordings if (w := windows_of(raw, interval, actuator.pole_pairs)) is not None]
        tried[factor] = min(sharp_misfits(windows, star, actuator.pole_pairs).values()) if windows else np.inf
    first, second = sorted(tried, key=lambda f: tried[f])[:2]
    put(first)
    words = {f: f"{LETTERS[k]} times {f:g}" if f != 1.0 else "as they are" for f in tried}
    finding = decided(
        Finding("two currents", words[first], tried[second] / tried[first], words[second], first != 1.0),
        "measure the third, or say signals.phase_current.sign and scale",
    )
    for key, changed in (("sign", first < 0.0), ("scale", abs(first) != 1.0)):
        if changed:
            refuse_stated(spec, "phase_current", key, finding)
    return [finding]


def check_sizes(
    recordings: Sequence[Raw], given: Given, actuator: ActuatorParameters, resistance: float, back_emf: float
) -> list[Finding]:
    """Decades of voltages, currents and bus, by k, R and the bus of the nominal actuator; put right in place.

    Raises
    ------
    InputError : sizes between two decades, or against the map
    """
    volts, of_volts = nearest("k beside the actuator's", abs(back_emf) / actuator.back_emf, DECADES)
    ratio = abs(resistance) / volts / actuator.resistance
    amps, of_amps = nearest("R beside the actuator's", ratio, DECADES)
    out = []
    for name, names, factor, finding, hint in (
        ("phase_voltage", ("phase_voltage",), 1.0 / volts, of_volts, "actuator.back_emf="),
        ("phase_current", CURRENTS, amps, of_amps, "actuator.resistance="),
    ):
        out.append(decided(finding, f"say signals.{name}.scale, or give {hint} of this machine"))
        if factor != 1.0:
            refuse_stated(given["signals"][name], name, "scale", finding)
            scale(recordings, names, np.full(3, factor))
    if "bus_voltage" in given["signals"]:
        bus = float(np.median([np.median(raw.single["bus_voltage"].values) for raw in recordings]))
        factor, finding = nearest("bus_voltage beside the actuator's", max(bus, 1e-12) / actuator.bus_voltage, DECADES)
        out.append(decided(finding, "say signals.bus_voltage.scale, or give actuator.bus_voltage= of this machine"))
        if factor != 1.0:
            refuse_stated(given["signals"]["bus_voltage"], "bus_voltage", "scale", finding)
            for raw in recordings:
                raw.single["bus_voltage"] = raw.single["bus_voltage"].scaled(1.0 / factor)
    return out


def scale(recordings: Sequence[Raw], names: Sequence[str], factors: np.ndarray) -> None:
    """Multiply phased signals by (3,) factors, in place."""
    for raw in recordings:
        for name in names:
            if name in raw.phased:
                three = zip(raw.phased[name], factors, strict=True)
                raw.phased[name] = [None if s is None else s.scaled(float(f)) for s, f in three]


def refuse_stated(spec: Given, name: str, key: str, finding: Finding) -> None:
    """Refuse a change of what the map states."""
    if key in spec:
        raise InputError(f"{finding.text()}, against signals.{name}.{key} of the map; take it out, or put it right")
