"""Skew and rate of a second logger's clock, from what its signals and those of the first have to do with each other."""

from collections.abc import Callable, Sequence

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..errors import InputError
from .electrical import unexplained
from .finding import Finding, decided
from .loading import Raw
from .windows import WINDOW, electrical_turn, windows_of

OVERLAP = 0.5  # of the shorter log, that two logs share at least
PER_TURN = 24  # skews tried in the shortest electrical turn
NOTICED = 1.1  # times the misfit
VALLEYS = 4  # of the search that are gone down: a drift hides which is deepest
REACH = 2.0  # s, within which two logs are begun by hand, or by a trigger
DRIFT = 1e-3  # first step of the search for a drift: loggers' clocks are better than that

Misfit = Callable[..., float]  # of skew (s), drift and the longest window (s)


def align(raw: Raw, logger: str, first: str, star, actuator: ActuatorParameters, interval: float) -> Finding:
    """Put the signals of ``logger`` on the clock of ``first``, in place.

    The skew is searched for at every place where the logs overlap enough, then refined together with the drift.

    Raises
    ------
    InputError : no signals by which the two can be compared, or a skew that they leave open
    """
    # both logs count from their own beginning: only the difference of their clocks is unknown
    starts = {name: min(s.time[0] for s in raw.signals() if s.logger == name) for name in (logger, first)}
    raw.change(lambda s: s.on_clock(starts[first] - starts[logger], 0.0) if s.logger == logger else s)
    misfit, least = _criterion(raw, logger, star, actuator, interval)
    spans = [_span(raw, name) for name in (logger, first)]
    reach = min(max(spans) - OVERLAP * min(spans), REACH)
    turn = electrical_turn(raw, actuator.pole_pairs)
    grid = np.arange(-reach, reach, turn / PER_TURN)
    values = np.array([misfit(s, 0.0) for s in grid])
    valleys: list[int] = []
    for k in np.argsort(values):
        if all(abs(grid[k] - grid[m]) > 0.25 * turn for m in valleys) and len(valleys) < VALLEYS:
            valleys.append(int(k))
    refined = sorted(_refined(misfit, grid[k], 0.0, turn / PER_TURN) for k in valleys)
    best, skew, drift = refined[0]
    # short windows see commutations pass, and tell the time better
    _, skew, drift = _refined(lambda *x: misfit(*x, interval), skew, drift, turn / PER_TURN)
    others = [*((x, at) for x, at, _ in refined), *zip(values, grid)]
    rival, other = min((x, at) for x, at in others if abs(at - skew) > 0.25 * turn)
    taken = f"{1e3 * skew:.2f} ms later than the start of {first}, {1e6 * drift:.0f} ppm slow"
    finding = Finding(f"{raw.name}: clock of {logger}", taken, rival / max(best, 1e-12), f"{1e3 * other:.2f} ms")
    decided(finding, f"say loggers.{logger}.clock.skew, or record a motion that starts and stops")
    step = max(s.step for s in raw.signals() if s.logger == logger)
    known = max(_width(misfit, skew, drift, step), least)
    raw.lost.append(
        f"the clock of {logger} is found to {1e6 * known:.0f} us: a lag of that between the loggers is not detected"
    )
    raw.change(lambda s: s.on_clock(skew, drift) if s.logger == logger else s)
    return finding


def _refined(misfit: Misfit, skew: float, drift: float, step: float) -> tuple[float, float, float]:
    from scipy.optimize import minimize

    scale = np.array([step, DRIFT])
    simplex = np.array([skew, drift]) / scale + np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]])
    options = {"initial_simplex": simplex, "xatol": 1e-2, "fatol": np.inf, "maxiter": 200}
    found = minimize(lambda x: misfit(*(x * scale)), simplex[0], method="Nelder-Mead", options=options)
    return float(found.fun), float(found.x[0] * step), float(found.x[1] * DRIFT)


def _width(misfit: Misfit, skew: float, drift: float, step: float) -> float:
    """How far (s) a skew may be from the one found without being noticed, in doublings of a sample's step."""
    best, width = misfit(skew, drift), step
    while width < WINDOW and min(misfit(skew + width, drift), misfit(skew - width, drift)) < NOTICED * best:
        width *= 2.0
    return width


def _span(raw: Raw, logger: str) -> float:
    mine = [s for s in raw.signals() if s.logger == logger]
    return min(s.end for s in mine) - max(s.begin for s in mine)


def _criterion(raw: Raw, logger: str, star, actuator: ActuatorParameters, interval: float) -> tuple[Misfit, float]:
    """Misfit as a function of skew and drift, of the voltage equation or of the shaft with the rotor; and the time (s)
    that it cannot tell in any case, of a shaft the play's.

    The former is that with the logger's signals over that without, so that where little moves little counts.
    """
    p, time_constant = actuator.pole_pairs, actuator.inductance / actuator.resistance
    parts = {k: next(s for s in raw.phased[k] if s is not None) for k in ("phase_voltage", "phase_current")}
    parts["angle"] = raw.single["rotor_angle"]
    mine = {name for name, s in parts.items() if s.logger == logger}
    if 0 < len(mine) < len(parts):
        alone = mine if len(mine) == 1 and "phase_voltage" not in mine else set(parts) - mine
        explaining = {"phase_current": slice(0, 1), "angle": slice(1, 3)}.get("".join(alone), slice(0, 3))

        def of_voltages(skew: float, drift: float, longest: float = WINDOW) -> float:
            w = windows_of(raw, interval, p, logger, skew, drift, longest)
            return unexplained(w, star, p, time_constant, explaining) if w is not None else np.inf

        return of_voltages, 0.0
    rotor, shaft = raw.single["rotor_angle"], raw.single["output_position"]
    if rotor.logger == shaft.logger:
        raise InputError(f"{raw.name}: nothing on the logger {logger} shows its clock; say loggers.{logger}.clock.skew")

    def of_shaft(skew: float, drift: float, longest: float = WINDOW) -> float:
        a, b = (s.on_clock(skew, drift) if s.logger == logger else s for s in (rotor, shaft))
        t = np.linspace(max(a.begin, b.begin), min(a.end, b.end), 2000)
        x, y = a.at(t), b.at(t)
        likeness = np.corrcoef(x, y)[0, 1] if np.ptp(x) > 0.0 and np.ptp(y) > 0.0 else 0.0
        return float(1.0 - likeness**2)

    shaft_speed = 2.0 * np.pi / (p * electrical_turn(raw, p) * actuator.gear_ratio)
    return of_shaft, actuator.backlash / shaft_speed


def clocks(recordings: Sequence[Raw], given, star, actuator: ActuatorParameters, interval: float) -> list[Finding]:
    """Put every logger on the first one's clock: as the map says, or as is found."""
    first = next(iter(given["loggers"]))
    out = []
    for raw in recordings:
        for logger, settings in given["loggers"].items():
            clock = settings["clock"]
            if logger == first or clock == "same" or not any(s.logger == logger for s in raw.signals()):
                continue
            if clock == "found":
                out.append(align(raw, logger, first, star, actuator, interval))
            else:
                from ..units import quantity

                skew = quantity(clock["skew"], "s", f"loggers.{logger}.clock.skew")
                raw.change(lambda s: s.on_clock(skew, clock.get("drift", 0.0)) if s.logger == logger else s)  # noqa: B023
    return out
