"""Phases put right: order, signs, direction and pole pairs as the voltage equation reads the channels."""

from collections.abc import Callable, Sequence

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .electrical import MOST_POLE_PAIRS, Reading, best, misfits, runner_up, sharp_misfits
from .finding import LEAST_MARGIN, Finding, decided
from .loading import Raw
from .probes import CURRENTS, LETTERS, Given, refuse_stated, scale
from .voltages import lines_to_phases
from .windows import windows_of

OPPOSITE = (2, 0, 1)  # phase that a line voltage a-b, b-c, c-a lacks
POLE_PAIRS, DIRECTION = "pole pairs", "direction of the phases"
ORDER, SIGN = "voltages beside currents, order", "voltages beside currents, signs"


def read_phases(
    recordings: Sequence[Raw], given: Given, actuator: ActuatorParameters, star: Callable, interval: float
) -> tuple[Reading, list[Finding]]:
    """Order, signs, direction and pole pairs by the voltage equation; nothing is changed.

    Raises
    ------
    InputError : readings that the data do not tell apart, or another number of pole pairs than the actuator's
    """
    p = actuator.pole_pairs
    windows = [w for raw in recordings if (w := windows_of(raw, interval, p)) is not None]
    if not windows:
        raise InputError(
            "no recording has 50 windows in which voltages, currents and the angle are all known; check clocks"
        )
    mistaken = {p * np.pi / 180.0: "rotor_angle in degrees", p * 2.0 * np.pi: "rotor_angle in turns"}
    total = misfits(windows, star, [*map(float, range(1, max(MOST_POLE_PAIRS, p) + 1)), *mistaken])
    r, out = best(total), []

    def say(what: str, words: Callable[[Reading], str], name: str) -> None:
        other, margin = runner_up(total, r, lambda x, y: getattr(x, name) != getattr(y, name))
        if other is not None:
            out.append(decided(Finding(what, words(r), margin, words(other)), remedy))
        else:
            out.append(Finding(what, f"{words(r)}, as the map says", np.inf, "none that it allows"))

    remedy = "record a faster or longer motion"
    say(POLE_PAIRS, lambda x: mistaken.get(x.pole_pairs, f"{x.pole_pairs:.4g}"), "pole_pairs")
    if r.pole_pairs != p:
        hint = "say signals.rotor_angle.source: electrical" if r.pole_pairs == 1 else "say signals.rotor_angle.unit"
        hint = hint if r.pole_pairs in (1, *mistaken) else f"give actuator.pole_pairs={r.pole_pairs:.0f}"
        raise InputError(f"{out[-1].text()}, the actuator has {p}; {hint}")
    total = _as_stated(sharp_misfits(windows, star, p), given)
    r = best(total)
    remedy += ", or say order and sign of both phase_voltage and phase_current"
    say(ORDER, lambda x: "abc as " + _letters(x.order), "order")
    say(SIGN, lambda x: _signs(x.signs), "signs")
    say(DIRECTION, lambda x: "with the rotor" if x.direction > 0 else "against the rotor", "direction")
    return r, out


def _as_stated(total: dict[Reading, float], given: Given) -> dict[Reading, float]:
    """The readings that leave what the map states of voltages and currents alike.

    Raises
    ------
    InputError : a reading that the map excludes fits better by the margin
    """
    specs = [given["signals"][name] for name in ("phase_voltage", "phase_current")]
    kept = dict(total)
    for key, name, plain in (("order", "order", (0, 1, 2)), ("sign", "signs", (1, 1, 1))):
        if all(key in spec for spec in specs):
            kept = {r: x for r, x in kept.items() if getattr(r, name) == plain}
    first, stated = best(total), best(kept)
    if first not in kept:
        margin = total[stated] / max(total[first], 1e-12)
        if margin >= LEAST_MARGIN:
            raise InputError(
                f"voltages beside currents: order {_letters(first.order)} and signs {_signs(first.signs)} fit "
                f"{margin:.3g} times better than what the map states of both; take order and sign out"
            )
    return kept


def _signs(signs: Sequence[int]) -> str:
    return "".join("+" if s > 0 else "-" for s in signs)


def _letters(order: Sequence[int]) -> str:
    return "".join(LETTERS[int(k)] for k in order)


def apply_phases(
    recordings: Sequence[Raw], given: Given, r: Reading, findings: Sequence[Finding], turn: Callable[[int | None], bool]
) -> list[Finding]:
    """Put right, in place, the one of voltages, currents and motion that the other two go against in this reading.

    Parameters
    ----------
    turn : puts the motion right given the direction of the phases, None where that is open itself; returns whether the
        rotor's angle was turned round

    Raises
    ------
    InputError : a choice that the data leave to the map, or that contradicts it
    """
    voltage, current = (given["signals"][name] for name in ("phase_voltage", "phase_current"))
    margin = {f.what: f for f in findings}
    lines = voltage["reference"] == "line_to_line"
    phases, signs = _of_phases(r) if lines else (r.order, r.signs)
    odd = _parity(phases) < 0
    free = [name for name, spec in (("phase_voltage", voltage), ("phase_current", current)) if "order" not in spec]
    direction, out, moved = r.direction, [], ""
    if phases == (0, 1, 2):
        direction *= -1 if turn(direction) else 1
    elif not free or (not odd and len(free) > 1):
        raise InputError(
            f"{margin[ORDER].text()}: which of the two has the right names the data do not show; say "
            "signals.phase_voltage.order or signals.phase_current.order"
        )
    else:
        direction *= -1 if turn(None) else 1
        moved = free[0] if len(free) == 1 else "phase_voltage" if direction > 0 else "phase_current"
        if moved == "phase_voltage":
            order = r.order
            _reorder(recordings, ("phase_voltage",), order)
            if lines and odd and sum(r.signs) > 0:  # two channels are swapped, not two phases
                signs = r.signs
            elif lines:
                scale(recordings, ("phase_voltage",), np.full(3, _parity(order)))
        else:
            order = tuple(int(k) for k in np.argsort(phases))
            _reorder(recordings, CURRENTS, order)
            direction = -direction if odd else direction
        out.append(Finding(moved, f"channels are of {_letters(order)}", margin[ORDER].margin, "abc", True))
    out += _apply_signs(recordings, given, signs, r.order if moved == "phase_voltage" else (0, 1, 2), margin[SIGN])
    if lines:
        for raw in recordings:
            raw.phased["phase_voltage"] = list(lines_to_phases(raw))
    return out + _apply_sense(recordings, given, direction, margin[DIRECTION])


def _apply_signs(recordings, given: Given, signs, place: Sequence[int], finding: Finding) -> list[Finding]:
    usual, out = (1 if sum(signs) > 0 else -1), []
    if usual < 0:  # either both signs make the same machine, with its poles the other way round
        name = "phase_voltage" if "sign" in given["signals"]["phase_current"] else "phase_current"
        refuse_stated(given["signals"][name], name, "sign", finding)
        scale(recordings, CURRENTS if name == "phase_current" else (name,), -np.ones(3))
        out.append(Finding(name, "all turned round", finding.margin, "as measured", True))
    single = np.array(signs) * usual
    if (single < 0).any():
        refuse_stated(given["signals"]["phase_voltage"], "phase_voltage", "sign", finding)
        factors = np.ones(3)
        factors[list(place)] = single
        scale(recordings, ("phase_voltage",), factors)
        which = ", ".join(LETTERS[k] for k in range(3) if factors[k] < 0)
        out.append(Finding("phase_voltage", f"channel of {which} turned round", finding.margin, "as measured", True))
    return out


def _of_phases(r: Reading) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Order and signs of line voltages as those of phases: an odd order turns every difference round."""
    phases = [0, 0, 0]
    for k, m in enumerate(r.order):
        phases[OPPOSITE[k]] = OPPOSITE[m]
    turned = _parity(r.order)
    return tuple(phases), tuple(s * turned for s in r.signs)


def _parity(order: Sequence[int]) -> int:
    return 1 if tuple(order) in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else -1


def _reorder(recordings: Sequence[Raw], names: Sequence[str], order: Sequence[int]) -> None:
    for raw in recordings:
        for name in names:
            if name in raw.phased:
                raw.phased[name] = [raw.phased[name][order.index(k)] for k in range(3)]
                if name == "phase_voltage" and raw.off is not None:
                    raw.off = raw.off[:, [order.index(k) for k in range(3)]]


def _apply_sense(recordings: Sequence[Raw], given: Given, direction: int, finding: Finding) -> list[Finding]:
    """What turns the wrong way round is the map's to say: the data fit both."""
    sense = given.get("sense")
    if direction > 0:
        if sense:
            raise InputError(f"{finding.text()}, but the map says sense: {sense}; take it out")
        return []
    if sense is None:
        raise InputError(
            "direction of the phases: a, b, c follow each other against the sense of the rotor (margin "
            f"{finding.margin:.3g}); say sense: phases_reversed if b and c are swapped in voltages and currents, or "
            "sense: motion_reversed if every angle counts the other way"
        )
    if sense == "phases_reversed":
        _reorder(recordings, ("phase_voltage", *CURRENTS), (0, 2, 1))
    else:
        for raw in recordings:
            raw.single = {k: s if k == "bus_voltage" else s.scaled(-1.0) for k, s in raw.single.items()}
    return [Finding("sense", f"{sense.replace('_', ' ')}, as the map says", finding.margin, "as measured", True)]
