"""Angles, speed and positions against each other: which counts the other way, and in which unit a speed is."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .finding import Finding, decided
from .loading import Raw
from .scales import nearest

SAMPLES = 500  # instants at which slow motions are compared
WITH = "goes with the rotor"
SHAFT = {"output_position", "commanded_position"}


def senses(recordings: Sequence[Raw], given: Mapping[str, Any], actuator: ActuatorParameters) -> dict[str, Finding]:
    """Whether speed, output and command go with the rotor's angle or against it; a speed's unit is found.

    Raises
    ------
    InputError : signals that do not go together, or in another unit than was said
    """
    names = [n for n in ("rotor_speed", "output_position", "commanded_position") if n in given["signals"]]
    found = {name: decided(_sense(recordings, name), "record a longer motion") for name in names}
    if "rotor_speed" in names:
        found["unit of rotor_speed"] = _speed_unit(recordings, actuator)
    for name in ("output_position", "commanded_position"):
        _position_unit(recordings, actuator, name)
    return found


def turn_round(
    recordings: Sequence[Raw], given: Mapping[str, Any], found: Mapping[str, Finding], direction: int | None
) -> tuple[list[Finding], bool]:
    """Turn round, in place, what counts against the rest: one signal, or both of the rotor or of the shaft.

    Parameters
    ----------
    found : of ``senses``
    direction : of the phases with the rotor's angle, which counts as one signal more; None where it is not known

    Returns
    -------
    what was turned, and whether the rotor's angle was among it

    Raises
    ------
    InputError : as many signals that count one way as the other, or one that the map states
    """
    with_rotor = {name: finding.taken == WITH for name, finding in found.items() if finding.what == name}
    votes = {"rotor_angle": True, **with_rotor} | ({} if direction is None else {"phases": direction > 0})
    for_it = sum(votes.values())
    minority = {n for n, v in votes.items() if v != (for_it > len(votes) / 2)}
    if "phases" in minority and len(minority) == 1:
        minority = set()  # names of phases are the map's to say
    tie = 2 * for_it == len(votes)
    if tie and direction is not None and len({votes[n] for n in SHAFT}) == 1:
        minority, tie = SHAFT, False  # one mistake explains it, of the rotor and the phases it would take two
    if tie or (len(minority) > 1 and minority not in ({"rotor_angle", "rotor_speed"}, SHAFT)):
        one, other = (" and ".join(sorted(n for n, v in votes.items() if v == side)) for side in (True, False))
        raise InputError(f"{one} count one way, {other} the other; say sign: -1 of those that are reversed")
    out = []
    for name in sorted(minority):
        margin = found[name].margin if name in found else min(f.margin for n, f in found.items() if f.what == n)
        if "sign" in given["signals"][name]:
            raise InputError(
                f"{name}: goes against the rest (margin {margin:.3g}) with signals.{name}.sign of the map; take it "
                "out, or put it right"
            )
        for raw in recordings:
            raw.single[name] = raw.single[name].scaled(-1.0)
        out.append(Finding(name, "turned round", margin, "as measured", True))
    return out, "rotor_angle" in minority


def _pairs(recordings: Sequence[Raw], name: str) -> tuple[np.ndarray, np.ndarray]:
    """The rotor's angle and another signal at the same instants, each less its mean, of all recordings; of a speed its
    integral."""
    out: list[tuple[np.ndarray, np.ndarray]] = []
    for raw in recordings:
        x, y = raw.single["rotor_angle"], raw.single[name]
        edges = np.linspace(max(x.begin, y.begin), min(x.end, y.end), SAMPLES)
        one = x.at(edges)
        other = np.append(0.0, np.cumsum(y.means(edges) * np.diff(edges))) if name == "rotor_speed" else y.at(edges)
        out.append((one - one.mean(), other - other.mean()))
    return np.concatenate([p[0] for p in out]), np.concatenate([p[1] for p in out])


def _sense(recordings: Sequence[Raw], name: str) -> Finding:
    """Which way a signal goes with the rotor; the margin is what the other sense leaves over what this one does."""
    x, y = _pairs(recordings, name)
    if not np.ptp(x) > 0.0 or not np.ptp(y) > 0.0:
        raise InputError(f"{name if np.ptp(x) > 0.0 else 'rotor_angle'}: never moves; a recording in motion is needed")
    likeness = float(np.clip(x @ y / np.sqrt((x @ x) * (y @ y)), -1.0, 1.0))
    words = (WITH, "goes against the rotor")
    taken, other = words if likeness > 0.0 else words[::-1]
    return Finding(name, taken, 1.0 / max(1.0 - likeness**2, 1e-9), other)


def _speed_unit(recordings: Sequence[Raw], actuator: ActuatorParameters) -> Finding:
    """Unit of the speed by the angle's rate; one that no file and no map says is put right in place.

    Raises
    ------
    InputError : another unit than was said
    """
    x, y = _pairs(recordings, "rotor_speed")
    p = actuator.pole_pairs
    factors = {
        1.0: "rad/s", 30.0 / np.pi: "rpm", 180.0 / np.pi: "deg/s", 0.5 / np.pi: "turns/s",
        p * 1.0: "electrical rad/s", p * 30.0 / np.pi: "electrical rpm",
        np.pi / 30.0: "rad/s, not rpm",
    }  # fmt: skip
    factor, unit = nearest("rotor_speed beside the rate of rotor_angle", abs(float(x @ y / (x @ x))), factors)
    decided(unit, "say signals.rotor_speed.scale")
    if factor != 1.0 and any(raw.single["rotor_speed"].known for raw in recordings):
        raise InputError(
            f"rotor_speed: is {factor:.4g} times the rate of rotor_angle (margin {unit.margin:.3g}): it "
            f"is in {unit.taken}; say signals.rotor_speed.unit or scale, or counts_per_turn of the angle"
        )
    for raw in recordings:
        raw.single["rotor_speed"] = raw.single["rotor_speed"].scaled(1.0 / factor)
    return unit


def _position_unit(recordings: Sequence[Raw], actuator: ActuatorParameters, name: str) -> None:
    """Refuse a shaft that does not turn with the rotor over the gear ratio.

    Raises
    ------
    InputError : naming the factor between them
    """
    x, y = _pairs(recordings, name)
    ratio = abs(float(x @ y / (x @ x))) * actuator.gear_ratio
    factors = {
        1.0: "rad",
        180.0 / np.pi: "degrees",
        0.5 / np.pi: "turns",
        1e3: "mrad",
        actuator.gear_ratio: "rotor rad",
    }
    factor, unit = nearest(f"{name} beside rotor_angle over the gear ratio", ratio, factors)
    decided(unit, f"check signals.{name}.unit, or give actuator.gear_ratio=")
    if factor != 1.0:
        raise InputError(
            f"{name}: moves {ratio:.4g} times as far as the rotor over the gear ratio, as if in {unit.taken}; say "
            f"signals.{name}.unit"
        )
