"""What to record next: of a menu of recordings, those whose equations tell the leading set from its rivals.

Each recording is simulated under the leading set at its fit. Its normal matrix is added to that of the bench, without a
residual of its own, as the leading set would leave none on average: the log odds of two sets change by what the
Gaussian evidence of both matrices together says more than that of the bench alone (expected log Bayes factor; Lindley
1956, Annals of Mathematical Statistics 27, 986, is the general case).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..actuator.commands import command_positions
from ..actuator.parameters import ActuatorParameters, make_runs
from ..actuator.sensors import SensorNoise, measure
from ..actuator.simulate import simulate, time_axis
from ..diagnosis.evidence import Normal
from ..diagnosis.fit import Bench, Fit
from ..diagnosis.search import Search
from ..diagnosis.sets import Model
from ..io.recording import Recording
from .machine import ReferenceActuator
from .parameters import FAULTS
from .signals import Signals

INTERVAL = 2e-4  # s
LIKELY = 0.02  # probability below which a set is no rival
RIVALS = 4
PROPOSED = 3
LARGEST_ODDS = 1e6
NEXT = "next"
#: command, its settings, length (s), ambient (degC); for a shaft that turns at 1 rad/s at most and by 0.5 rad
#: to either side
MENU: tuple[tuple[str, Mapping[str, float], float, tuple[float, ...]], ...] = (
    ("parabolic", {"acceleration": 0.6}, 0.6, (20.0,)),
    ("ramp", {"speed": 0.03}, 1.0, (20.0, 80.0)),
    ("ramp", {"speed": -0.4}, 0.6, (20.0, -40.0)),
    ("reversal", {"amplitude": 0.01, "speed": 0.1}, 0.6, (20.0, -40.0)),
    ("sine", {"amplitude": 0.04, "frequency": 2.0}, 0.6, (20.0, 80.0)),
    ("chirp", {"amplitude": 0.01, "frequency_start": 1.0, "frequency_end": 12.0}, 0.6, (20.0,)),
)
UNITS = {"acceleration": "rad/s2", "speed": "rad/s", "amplitude": "rad"}  # what goes with the shaft's reach


def menu(actuator: ActuatorParameters) -> list[tuple[str, dict[str, float], float, tuple[float, ...]]]:
    """The menu for an actuator: motions of the same share of its speed, or of its travel where that is less."""
    reach = min(actuator.speed_limit / actuator.gear_ratio, 2.0 * actuator.end_stop)
    return [
        (command, {k: float(f"{v * reach if k in UNITS else v:.3g}") for k, v in settings.items()}, duration, ambients)
        for command, settings, duration, ambients in MENU
    ]


def next_recordings(
    bench: Bench,
    fit: Fit,
    first: Model,
    rivals: Sequence[tuple[tuple[str, ...], Model]],
    values: Mapping[str, float],
    effects: Mapping[str, Mapping[str, float]],
    noise: SensorNoise,
) -> list[dict[str, Any]]:
    """The best recordings of the menu, as the verdict file lists them.

    Parameters
    ----------
    first : the leading set; ``rivals`` sets by their listed effects
    values : of all parameters at the leading set's fit
    effects : the same as the simulator takes them, tolerances among them
    """
    if not rivals:
        return []
    actuator: ActuatorParameters = bench.machine.actuator
    before = {names: _log_odds(bench, fit.normal, first, rival, {}) for names, rival in rivals}
    named = _name(first, bench)
    found: list[dict[str, Any]] = []
    for n, (command, settings, duration, ambients) in enumerate(menu(actuator)):
        for ambient in ambients:
            recording = _imagined(actuator, noise, values, effects, (command, settings, duration, ambient), n)
            new, widths = _next_normal(bench, recording, noise)
            normal = _with_next(fit, new)
            for names, rival in rivals:
                gain = _log_odds(bench, normal, first, rival, widths) - before[names]
                text = ", ".join(f"{k.replace('_', ' ')} {v:g} {UNITS.get(k, 'Hz')}" for k, v in settings.items())
                found.append(
                    {
                        "command": f"{command}, {text}, {duration:g} s", "ambient_temperature": ambient,
                        "separates": ["+".join(named) or "no_gap", "+".join(names) or "no_gap"],
                        "expected_odds": float(np.exp(np.clip(gain, 0.0, np.log(LARGEST_ODDS)))),
                        "motion": {"name": command, "duration": duration, "settings": dict(settings)},
                    }
                )  # fmt: skip
    best: dict[str, dict[str, Any]] = {}
    for entry in sorted(found, key=lambda e: -e["expected_odds"]):
        best.setdefault(entry["separates"][1], entry)
    return sorted(best.values(), key=lambda e: -e["expected_odds"])[:PROPOSED]


def _name(model: Model, bench: Bench) -> tuple[str, ...]:
    listed = {u.id for u in bench.units if u.kind in ("structural", "calibration")}
    return tuple(sorted(u for u in model.units if u in listed))


def _imagined(actuator, noise, values, effects, entry, seed) -> Recording:
    """A recording as the leading set says that it would be; the unit in its present state."""
    command, settings, duration, ambient = entry
    fault = np.array([values.get(c, 0.0) for c in FAULTS] + [ambient - actuator.reference_temperature])
    runs = make_runs(actuator, fault[None], effects=effects, theta_0=1.0)
    position = command_positions(command, settings, duration, actuator.control_period)
    signals = measure(simulate(runs, position, duration, INTERVAL), runs, noise, 7, seed)
    signals.pop("ambient_temperature")
    health = "unknown" if FAULTS[0] in values else "healthy"
    return Recording(
        time=time_axis(duration, INTERVAL), ambient_temperature=ambient,
        attributes={"health": health, "command": command}, name=NEXT,
        **{name: array[0] for name, array in signals.items()},  # type: ignore[arg-type]
    )  # fmt: skip


def _next_normal(bench: Bench, recording: Recording, noise: SensorNoise) -> tuple[Normal, dict[str, float]]:
    """Normal matrix of the imagined recording at the point of the bench, without its residual; widths of the priors of
    what belongs to it alone."""
    actuator = bench.machine.actuator
    signals, of = {NEXT: Signals.of(NEXT, recording, actuator, noise)}, bench.machine
    machine = ReferenceActuator(actuator, signals, of.left_out, of.catalogue, of.reference)
    new = Bench(machine, [NEXT])
    new.point |= {n: v for n, v in bench.point.items() if n in new.point}
    new.on = set(bench.on)
    new.remainders = bench.remainders
    normal = new.normal(new.linearise())
    widths = {n: p.sd for n, p in new.parameters.items() if n.endswith(f"@{NEXT}")}
    return Normal(normal.names, normal.H, np.zeros_like(normal.g), 0.0), widths


def _with_next(fit: Fit, new: Normal) -> Normal:
    """Sum of both normal matrices over the columns of either."""
    names = list(dict.fromkeys([*fit.normal.names, *new.names]))
    index = {n: k for k, n in enumerate(names)}
    H, g = np.zeros((len(names), len(names))), np.zeros(len(names))
    for normal in (fit.normal, new):
        k = np.array([index[n] for n in normal.names])
        H[np.ix_(k, k)] += normal.H
        g[k] += normal.g
    return Normal(names, H, g, fit.normal.c)


def _log_odds(bench: Bench, normal: Normal, first: Model, rival: Model, widths: Mapping[str, float]) -> float:
    """Difference of the log evidences of two sets under a normal matrix, what is the new recording's own integrated."""
    own = np.array([k for k, n in enumerate(normal.names) if n in widths], int)
    # a column that is off in both sets, and at the point, changes nothing
    kept = set(bench.nuisances) | {n for m in (first, rival) for n in m.deviations}
    equations = [u.split(":", 1)[1] for m in (first, rival) for u in m.units if u.startswith("remainder:")]
    left = tuple(f"remainder.{e}." for e in equations)
    rest = np.array(
        [
            k
            for k, n in enumerate(normal.names)
            if n not in widths and (n in kept or n.startswith(left) or bench.prior(n)[2] != 0.0)
        ],
        int,
    )
    H = normal.H[np.ix_(rest, rest)]
    if len(own):
        sd = np.array([widths[normal.names[k]] for k in own])
        A = normal.H[np.ix_(own, own)] * np.outer(sd, sd) + np.eye(len(own))
        cross = normal.H[np.ix_(rest, own)] * sd
        H = H - cross @ np.linalg.solve(A, cross.T)
    reduced = bench.reduce(Normal([normal.names[k] for k in rest], H, normal.g[rest], normal.c))
    units, candidates = bench.candidates(reduced)
    search = Search(reduced, units, candidates)
    values = [search.fit(tuple((c.unit, c.variant) for c in m.choices)).log_likelihood for m in (first, rival)]
    return values[0] - values[1]
