"""Signatures for the gallery: what an effect or form adds to its equation, drawn along the coordinate that tells it.

One recording of the default actuator is simulated, healthy and without noise, in the default sine, which goes through
all speeds in both directions. A signature is the residual of the nominal equation less that with the effect, at the
recorded signals: what the nominal equation would leave of a recording of a unit with the effect. The effect has half of
its realistic range.
"""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import matplotlib
import numpy as np
from views import AXES, FORM_SIZE, FORM_VIEWS, QUANTITY, VIEWS, View

from emafault import config
from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import ActuatorParameters, make_runs
from emafault.actuator.sensors import SensorNoise
from emafault.actuator.simulate import simulate, time_axis
from emafault.diagnosis.forms import FORMS
from emafault.diagnosis.model import Block
from emafault.effects import EFFECTS
from emafault.equations import commutation
from emafault.equations.machine import ReferenceActuator
from emafault.equations.point import Point, State
from emafault.equations.signals import Signals
from emafault.io.recording import Recording
from emafault.reporting import style  # noqa: F401  (the looks of all figures, and a backend without a screen)

import matplotlib.pyplot as plt  # isort: skip

COLOURS = ("#0072b2", "#d55e00", "#009e73")  # Okabe and Ito's, with lines of their own: told apart without colours
LINES = ("-", "--", ":")
COGS = 36.0  # pairs of cogs in a turn
FAST, SLOW = 0.7, 0.25  # of the largest speed, from which on rows are fast, and up to which they are slow
WARMEST = 70.0  # K, of a recording above the reference temperature, and coldest below
STEADY = 1000.0  # rad/s2, that the rotor's acceleration has at most but for the moments in which it turns round
RIPPLE = 0.8  # A, the most that a current changes by in an interval but for commutations
CRAWL = 10.0  # rad/s, up to which steps of the speed are seen one by one
SETTLED = 0.1  # s, after which the start of the motion has died away
POINTS, CELLS = 60, 60  # of a curve: rows shown, cells along the coordinate whose medians the line joins
SIZE = (3.6, 2.2)  # inch


@dataclass(frozen=True)
class Curve:
    """A signature's values along a coordinate, (row,) each."""

    label: str
    along: np.ndarray
    value: np.ndarray


@dataclass(frozen=True)
class Picture:
    """A drawn signature."""

    svg: str
    alt: str
    sizes: str  # of the parameters
    apart: str


@cache
def machine() -> ReferenceActuator:
    """The nominal actuator with its recording, as it is and at other ambient temperatures."""
    composed = config.compose(overrides=["command=sine", "sensors=ideal"])
    spec, recording, settings = config.diagnosis_spec(composed), composed["recording"], dict(composed["command"])
    actuator, noise = ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"])
    duration, interval = recording["duration"], recording["interval"]
    command = command_positions(settings.pop("name"), settings, duration, actuator.control_period)
    signals = simulate(make_runs(actuator, np.zeros((1, 6))), command, duration, interval)
    ambient = actuator.reference_temperature
    recorded = Recording(
        time=time_axis(duration, interval), ambient_temperature=ambient,
        attributes={"health": "healthy", "command": "sine"},
        **{name: values[0] for name, values in signals.items()},
    )  # fmt: skip
    plain = Signals.of("plain", recorded, actuator, noise)
    temperatures = ambient + WARMEST * np.linspace(-1.0, 1.0, 9)
    warm = {f"{t:g}": replace(plain, name=f"{t:g}", ambient=float(t)) for t in temperatures}
    return ReferenceActuator(actuator, {"plain": plain, **warm})


def sizes(effect: str) -> dict[str, float]:
    """Parameters of an effect at half of their range; of single phases at this, at half of it, and off."""
    out = {}
    for name, p in EFFECTS[effect].parameters.items():
        far = p.high if abs(p.high - p.nominal) >= abs(p.low - p.nominal) else p.low
        share = 0.5
        if name[-2:] in ("_a", "_b", "_c"):
            other = -0.25 if p.low < p.nominal < p.high else 0.25
            share = {"a": 0.5, "b": other, "c": 0.0}[name[-1]]
        value = p.nominal + share * (far - p.nominal)
        out[name] = value if share == 0.0 else float(np.clip(value, p.low, p.high))
    return out


def _fitted(effect: str, values: Mapping[str, float]) -> dict[str, float]:
    """The same as the equations take them, by full name."""
    known = dict(values)
    if effect == "dynamic_eccentricity":
        d, psi = known["d"], known["psi"]
        known = {"d_cos": d * np.cos(psi), "d_sin": d * np.sin(psi)}
    elif effect == "stribeck":
        known["log_w_s"] = np.log(known.pop("w_s"))
    elif effect == "compliance":
        known["flexibility"] = 1.0 / known.pop("K")
    return {f"{effect}.{name}": value for name, value in known.items()}


def _blocks(values: Mapping[str, float], recording: str = "plain") -> dict[str, Block]:
    return {b.equation: b for b in machine().blocks(values, recording, wanted=())}


@cache
def _off() -> dict[str, float]:
    return {name: p.off for name, p in machine().parameters.items()}


@cache
def _nominal(recording: str = "plain") -> dict[str, Block]:
    return _blocks(_off(), recording)


@cache
def _edges() -> tuple[np.ndarray, ...]:
    """Rows of the commutations of each phase."""
    rec = machine().recordings["plain"]
    state = State(rec, Point(_off(), rec.name, ()))
    return tuple(commutation.rows_of(state, j) for j in range(3))


def _added(effect: str, values: Mapping[str, float], equation: str, recording: str = "plain") -> np.ndarray:
    """(row,) what an effect adds to the residual of an equation."""
    if effect == "speed_quantisation":  # told by its lattice, and by no equation
        step, speed = values["step"], machine().recordings[recording].rate
        return step * np.round(speed / step) - speed
    there = _blocks(_off() | _fitted(effect, values), recording)[equation]
    return _nominal(recording)[equation].residual - there.residual


def curves(effect: str, view: View) -> list[Curve]:
    """What a view shows of an effect."""
    values = sizes(effect)
    if view.parameters:
        values = EFFECTS[effect].off | {name: values[name] for name in view.parameters}
    if view.along == "temperature":
        return [_over_temperature(effect, view, values)]
    if view.curves == "parameters":
        each = [(_size(effect, n, v), EFFECTS[effect].off | {n: v}, 0) for n, v in values.items()]
    elif view.curves == "phases":
        each = [(f"phase {j}", values, n) for n, j in enumerate("abc")]
    else:
        each = [("", values, 0)]
    out = []
    for label, given, phase in each:
        equation = f"electrical_{'abc'[phase]}" if view.equation == "electrical" else view.equation
        y, x = _added(effect, given, equation) * _sign(view, phase), _along(view, phase)
        keep = _nominal()[equation].usable & _rows(view, phase)
        if view.curves == "sizes":
            level = np.abs(machine().recordings["plain"].current[:, phase])
            middle = float(np.median(level[keep & (level > 0.1)]))
            for words, part in (("below", level < middle), ("above", level >= middle)):
                out.append(Curve(f"current {words} {middle:.1f} A", x[keep & part], y[keep & part]))
        else:
            out.append(Curve(label, x[keep], y[keep]))
    return out


def _over_temperature(effect: str, view: View, values: Mapping[str, float]) -> Curve:
    """Mean of what is added over the rows that count, recording by recording."""
    equation = "electrical_a" if view.equation == "electrical" else view.equation
    x, y = [], []
    for name, rec in machine().recordings.items():
        if name != "plain":
            keep = _nominal(name)[equation].usable & _rows(view, 0)
            x.append(rec.ambient)
            y.append(float(_added(effect, values, equation, name)[keep].mean()))
    return Curve("", np.array(x), np.array(y))


def _along(view: View, phase: int) -> np.ndarray:
    """(row,) the coordinate of a view."""
    rec = machine().recordings["plain"]
    if view.equation == "commutation":
        return np.concatenate([np.rad2deg(commutation.sweep(rec, j)[2][rows]) for j, rows in enumerate(_edges())])
    if view.equation == "control":
        return np.asarray(_nominal()["control"].coordinates["time"])
    known = {
        "speed": rec.rate if view.equation == "sensor_speed" else rec.speed, "acceleration": rec.acceleration,
        "output": rec.shaft, "carried": rec.shaft, "time": rec.time, "angle": rec.middle,
        "turn": np.mod(rec.middle, 2.0 * np.pi),
        "cogs": np.mod(rec.middle, 2.0 * np.pi / COGS),
        "electrical_angle": np.rad2deg(np.mod(rec.actuator.pole_pairs * rec.middle, 2.0 * np.pi)),
        "current": rec.current[:, phase], "current_change": _change(phase),
        "voltage": rec.voltage[:, phase], "bus_current": np.asarray(_nominal()["bus"].coordinates["drivers"][1]),
    }  # fmt: skip
    return known[view.along]


def _change(phase: int) -> np.ndarray:
    """(sample,) by how much the current changes within an interval (A)."""
    end = machine().recordings["plain"].current_end
    assert end is not None
    return np.diff(end[:, phase], prepend=0.0)


def _sign(view: View, phase: int) -> np.ndarray | float:
    """(row,) direction in which what is added is counted."""
    rec = machine().recordings["plain"]
    if view.equation == "commutation":  # that of the current which sets in
        stays = [rec.current[rows, commutation.STAYS[j]] for j, rows in enumerate(_edges())]
        return -np.sign(np.concatenate(stays))
    if view.signed == "back-EMF":
        return np.sign(np.sin(rec.actuator.pole_pairs * rec.middle - rec.axis[phase]))
    return np.sign(rec.current[:, phase]) if view.signed == "current" else 1.0


def _rows(view: View, phase: int) -> np.ndarray:
    """(row,) which rows count."""
    rec = machine().recordings["plain"]
    fast = rec.speed > FAST * rec.speed.max()
    if view.equation == "commutation":
        return np.concatenate(
            [(j == phase) & fast[rows] & (rec.time[rows] > SETTLED) for j, rows in enumerate(_edges())]
        )
    if view.equation == "control":
        return np.asarray(_nominal()["control"].coordinates["time"]) > SETTLED
    x = np.mod(rec.actuator.pole_pairs * rec.middle - rec.axis[phase], np.pi)
    reach = rec.actuator.pole_pairs * np.abs(rec.half_sweep)
    plateau = (x > np.pi / 6.0 + reach) & (x < 5.0 * np.pi / 6.0 - reach)
    rising = np.sin(rec.actuator.pole_pairs * rec.middle - rec.axis[phase]) > 0.0
    chosen = {
        "fast": fast, "slow": np.abs(rec.speed) < SLOW * rec.speed.max(), "plateau": plateau & rising,
        "plateau_fast": plateau & fast, "on": plateau & rising & fast, "driven": np.abs(rec.current[:, phase]) > 0.5,
        "ahead": rec.speed > 0.1 * rec.speed.max(),
        "steady": np.abs(rec.acceleration) < STEADY,
        "ripple": plateau & (np.abs(_change(phase)) < RIPPLE),
        "crawl": (rec.rate > 0.0) & (rec.rate < CRAWL),
    }  # fmt: skip
    return chosen.get(view.rows, np.ones(rec.size, bool)) & (rec.time > SETTLED)


def form_curve(name: str) -> Curve:
    """What a form adds to the torque."""
    view, block = FORM_VIEWS[name], _nominal()["torque"]
    y = np.asarray(view.coefficients) @ FORMS[name].columns(block.coordinates, view.shape)
    if view.against_motion:
        y = y * np.asarray(block.coordinates["drivers"][1])
    x = _along(View("torque", view.along, ""), 0)
    keep = block.usable & (x >= 0.0 if np.isfinite(view.until) else True) & (x <= view.until)
    order = np.argsort(x[keep], kind="stable")
    return Curve("", x[keep][order], y[keep][order])


def of_effect(effect: str) -> Picture:
    """The signature of an effect."""
    views = VIEWS[effect]
    drawn = [(view, curves(effect, view)) for view in views]
    panels = [(AXES[v.along], _quantity(v), c, v.path or v.along == "temperature") for v, c in drawn]
    told = ", ".join(_size(effect, n, v) for n, v in sizes(effect).items())
    alt = "; ".join(_said(view, panel) for view, panel in zip(views, panels, strict=True))
    return Picture(_svg(panels), f"Signature for {told}: {alt}", told, views[0].apart)


def of_form(name: str) -> Picture:
    """The signature of a form in the torque."""
    view, curve = FORM_VIEWS[name], form_curve(name)
    panel = AXES[view.along], QUANTITY["torque"], [curve], True
    alt = _said(View("torque", view.along, view.seen), panel)
    return Picture(_svg([panel]), f"Example of the form: {alt}", f"{FORM_SIZE:g} N m", view.apart)


Panel = tuple[str, str, list[Curve], bool]


def _said(view: View, panel: Panel) -> str:
    """A panel in words."""
    along, quantity, shown, _ = panel
    ends = np.array([min(c.value.min() for c in shown), max(c.value.max() for c in shown)])
    low, high = np.where(np.abs(ends) < 1e-6 * np.abs(ends).max(), 0.0, ends)
    where = f"added {quantity.rpartition(' (')[0]} over {along.rpartition(' (')[0]}"
    values = f"{low:.2g}" if f"{low:.2g}" == f"{high:.2g}" else f"from {low:.2g} to {high:.2g}"
    return f"{where}, {view.seen}; {values} {quantity.rpartition('(')[2].rstrip(')')}"


def _quantity(view: View) -> str:
    one = view.equation == "electrical" and view.curves != "phases"
    words = QUANTITY[view.equation].replace("the phase", "phase a") if one else QUANTITY[view.equation]
    return f"voltage along the {view.signed} (V)" if view.signed else words


def _size(effect: str, name: str, value: float) -> str:
    units = EFFECTS[effect].parameters[name].units
    return f"{name} = {value:.4g}" + ("" if units == "1" else f" {units}")


def _svg(panels: Sequence[Panel]) -> str:
    """A picture of panels, one below the other; its text stays text."""
    with matplotlib.rc_context(
        {"svg.fonttype": "none", "svg.hashsalt": "signature", "font.size": 8, "axes.labelsize": 8}
    ):
        figure, axes = plt.subplots(len(panels), figsize=(SIZE[0], SIZE[1] * len(panels)))
        for at, (along, quantity, shown, joined) in zip(np.atleast_1d(axes), panels, strict=True):
            at.axhline(0.0, color="#8a8a8a", linewidth=0.8)
            for curve, colour, line in zip(shown, COLOURS, LINES):
                _draw(at, curve, colour, line, joined)
            at.set(xlabel=along, ylabel=quantity)
            at.ticklabel_format(axis="y", scilimits=(-3, 4))
            if len(shown) > 1:
                above = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": len(shown)}
                at.legend(fontsize=7, handlelength=2.2, borderpad=0.2, columnspacing=1.0, **above)
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None})
        plt.close(figure)
    return buffer.getvalue()


def _draw(at, curve: Curve, colour: str, line: str, joined: bool) -> None:
    if joined:
        marker = "o" if len(curve.along) < 20 else ""
        at.plot(curve.along, curve.value, line, color=colour, marker=marker, markersize=3, linewidth=1.5)
        return
    order = np.argsort(curve.along, kind="stable")
    x, y = curve.along[order], curve.value[order]
    some = np.unique(np.linspace(0, len(x) - 1, POINTS).astype(int))
    at.plot(x[some], y[some], ".", color=colour, markersize=2.5, alpha=0.35)
    cell = np.minimum((CELLS * (x - x[0]) / (x[-1] - x[0])).astype(int), CELLS - 1)
    parts = np.split(np.arange(len(x)), np.flatnonzero(np.diff(cell)) + 1)
    middle_x, middle_y = ([float(np.median(v[p])) for p in parts] for v in (x, y))
    at.plot(middle_x, middle_y, line, color=colour, linewidth=1.5, label=curve.label)
