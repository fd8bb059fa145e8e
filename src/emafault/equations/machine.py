"""The reference actuator for the diagnosis: its parameters, effects and forms, and its equations at a point."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..diagnosis.model import SETTINGS, Block, Parameter, Unit
from ..effects import Effect
from ..effects.scaling import scaled
from . import (
    angle_error,
    bus,
    commutation,
    control,
    electrical,
    position,
    sensor_current,
    sensor_speed,
    torque,
    waveform,
    windings,
)
from .coordinates import (
    ALONG,
    COEFFICIENTS,
    OWN_ALONG,
    OWN_OF_CONTROL,
    at_ends,
    coordinates_of,
    drivers_of,
    functions_of,
    rows_of,
)
from .dual import Dual, value_of
from .parameters import beyond_tolerance, controller, internal, measuring_chain, nuisances, unit_of
from .point import Point, State, effect_name
from .signals import Signals
from .terms import with_hook

#: channels whose faults show in an equation, as what one of its drivers multiplies: a wave of the recorded angle is
#: also one of its rate, times the speed
CHANNELS = {
    ("sensor_speed", 0): ("angle",), ("sensor_speed", 1): ("angle",), ("torque", 0): ("angle",),
    ("position", 0): ("angle", "output"), ("sensor_current", 0): ("current_a", "current_b", "current_c"),
    **{(f"electrical_{j}", 0): (f"current_{j}", "voltage") for j in "abc"},
}  # fmt: skip
#: equations by name, beside those of the phases
OF_STATE = {
    "sensor_current": sensor_current, "sensor_speed": sensor_speed, "torque": torque, "position": position, "bus": bus,
    "control": control, "commutation": commutation,
}  # fmt: skip
#: equation -> its channel, which may be slower than the recording
OF_CHANNEL = {"sensor_speed": "speed", "position": "output", "bus": "bus"}
#: equations in which the rounding of an encoder's counts is most of the noise
OF_COUNTS = ("torque", "sensor_speed")
FEWEST_EDGES = 20  # that a recording is asked about its commutations with
RESISTANCE = 1  # driver of the electrical equations, the phase's current
BACK_EMF = 2  # driver of the electrical equations, speed times the shape, and of the torque's, that of the motor
STANDS_OUT = 10.0  # of a channel's noise, for the scale of forms in it
COEFFICIENT_SCALE = 0.02  # relative change of a coefficient, for the scale of its forms
LARGE = 400_000  # samples of a bench, from which on what is easily computed anew is kept of one recording at a time


class ReferenceActuator:
    """Recordings of one unit of the reference actuator as the diagnosis sees them."""

    name = "actuator"
    #: channel and equation, what shows of one in the other depends on the point
    moving = (("angle", "commutation"), ("angle", "sensor_speed"))
    #: channels whose forms are taken off the recorded signal: what equations make of it depends on the point
    undone = frozenset(c for channels in CHANNELS.values() for c in channels)

    def __init__(
        self,
        actuator: ActuatorParameters,
        recordings: Mapping[str, Signals],
        exclude: Sequence[str] = (),
        catalogue: Mapping[str, Effect] | None = None,
        reference: str | None = None,
    ):
        self.actuator = actuator
        # gains of recordings are told against that of one: what they all have is the unit's own
        self.reference = reference or max(recordings, key=lambda n: float(np.abs(np.diff(recordings[n].angle)).sum()))
        self.catalogue = dict(catalogue or scaled(actuator))
        self.recordings = dict(recordings)
        self._disturbed: dict[str, Signals] = {}
        self._along: dict[tuple[str, str], dict[str, Any]] = {}
        self._functions: dict[str, dict[str, Any]] = {}
        #: by recording, term and equation, what a late angle takes out
        self._late: dict[str, dict[int, dict[str, np.ndarray]]] = {}
        self.large = sum(r.size for r in self.recordings.values()) > LARGE
        self.left_out = tuple(exclude)
        self.effects = {k: e for k, e in self.catalogue.items() if k not in exclude}
        self.parameters = nuisances(actuator, self.catalogue, self.recordings)
        self.units = [
            unit_of(e, actuator, self.parameters) for e in self.effects.values() if e.id != "speed_quantisation"
        ]
        self.units += [*measuring_chain(actuator, self.recordings, self.reference, exclude), *controller(actuator)]
        self.units += [windings.unit(), windings.salient(), windings.mutual()]
        #: by effect, parameters that a form of its own may have: another shape of the back-EMF has other harmonics
        self.own_parameters: dict[str, tuple[str, ...]] = {}
        shapes = [m for m in map(effect_name, with_hook("harmonics")) if m in self.effects]
        if shapes:
            beside = {p.name: replace(p, fixed=True) for p in waveform.parameters()}
            self.own_parameters = dict.fromkeys(shapes, tuple(beside))
            self.parameters |= beside
        else:
            self.units.append(waveform.unit())
        lacking = [e for e in self.catalogue.values() if e.id in exclude]
        self.units += beyond_tolerance(lacking, actuator, self.parameters)
        for unit in self.units:
            for p in unit.parameters:
                self.parameters.setdefault(p.name, p)
        for effect in self.catalogue.values():  # one left out of the library is off
            for name, q in internal(effect, actuator).items():
                full = f"{effect.id}.{name}"
                if full not in self.parameters and effect.id not in self.effects:
                    self.parameters[full] = Parameter(full, q.off, q.off, 0.0, q.units, fixed=True)

    def families(self, equation: str) -> tuple[tuple[int, ...], ...]:
        """Functions of a remainder that go along one coordinate; none of the controller's equations."""
        return () if equation in SETTINGS else ALONG

    def own_families(self, equation: str) -> tuple[tuple[int, ...], ...]:
        """Functions of an own form that go along one coordinate; none of the commutations."""
        if equation == "control":
            return OWN_OF_CONTROL
        return () if equation in SETTINGS else OWN_ALONG

    def observed(self) -> dict[str, dict[str, float]]:
        """Effects that the recordings show for certain, with their parameters: a speed that lies on a lattice."""
        steps = [r.speed_step for r in self.recordings.values()]
        least = self.catalogue["speed_quantisation"].parameters["step"].low
        if "speed_quantisation" in self.effects and min(steps) >= 0.5 * least:
            return {"speed_quantisation": {"step": float(np.median(steps))}}
        return {}

    # ---- equations
    def prepare(self, name: str, values: Mapping[str, float]) -> None:
        """Compute once what does not depend on the point, or hardly: coordinates and drivers are those of the first."""
        if (name, "torque") in self._along:
            return
        point = Point(values, name, ())
        self._recording(values, self.recordings[name], ())
        noisy = State(self._noisy(name), point)
        torque.residual(noisy)
        for equation in (e for n, e in self._along if n == name and e not in SETTINGS):
            along = self._along[name, equation]
            changed = np.array(drivers_of(noisy, equation, self._functions_of(noisy.rec)))
            along["changes"] = (changed - along["drivers"]).astype(np.float32)

    def _noisy(self, name: str) -> Signals:
        """A recording with one more draw of the sensors' noise."""
        if name not in self._disturbed:
            if self.large:
                self._disturbed.clear()
            self._disturbed[name] = self.recordings[name].disturbed(1)
        return self._disturbed[name]

    def samples(self, name: str) -> int:
        """Number of samples of a recording."""
        return self.recordings[name].size

    def blocks(
        self,
        values: Mapping[str, float],
        name: str,
        disturbed: bool = False,
        wanted: Collection[str] | None = None,
        less: Mapping[str, np.ndarray] | None = None,
    ) -> list[Block]:
        """Residuals of every equation of a recording, with columns by every parameter, or by those ``wanted``.

        ``disturbed`` takes the recording with one more draw of the sensors' noise; ``less`` is what a channel has too
        much, (sample,).
        """
        self.prepare(name, values)
        rec = self._noisy(name) if disturbed else self.recordings[name]
        of_angle = [n for n in angle_error.names(name) if wanted is None or n in wanted]
        less = dict(less or {})
        ahead = angle_error.correction(values, name)
        terms = angle_error.terms(self.recordings[name]) if of_angle or ahead.any() else np.zeros((0, 0))
        if ahead.any():
            less["angle"] = less.get("angle", 0.0) - ahead @ terms
        blocks = self._recording(values, _less(rec, less), wanted)
        if of_angle:
            self._add_angle_error(blocks, values, terms, of_angle, less)
        return blocks

    # ---- the measuring chain
    def _add_angle_error(
        self,
        blocks: Sequence[Block],
        values: Mapping[str, float],
        terms: np.ndarray,
        names: Sequence[str],
        less: Mapping[str, np.ndarray],
    ) -> None:
        """Columns of what an angle is late or off by, of the ``terms`` of ``angle_error``, to blocks of a recording."""
        name = blocks[0].recording
        by_name = angle_error.derivatives(values, name)
        shares = np.array([by_name[n] for n in names])
        used = np.flatnonzero(shares.any(axis=0))
        if self.large and name not in self._late:
            self._late.clear()
        known = self._late.setdefault(name, {})
        if new := [k for k in used.tolist() if k not in known]:
            for equation, rows in self.seen_in("angle", name, terms[new]).items():
                for k, row in zip(new, rows, strict=True):
                    known.setdefault(k, {})[equation] = -row
        state = State(_less(self.recordings[name], less), Point(values, name, ()))
        for block in blocks:
            if all(block.equation in known[k] for k in used.tolist()):
                shown = np.array([known[k][block.equation] for k in used.tolist()])
            else:
                shown = -_seen(state, block.equation, terms[used])
            for n, column in zip(names, shares[:, used] @ shown, strict=True):
                # a logger may have channels that stand in the equation beside the angle
                block.columns[n] = block.columns[n] + column if n in block.columns else column

    def channels(self, equation: str, driver: int) -> tuple[str, ...]:
        """Channels in which a form of a driver of an equation may lie, rather than in the equation itself."""
        return CHANNELS.get((equation, driver), ())

    def coefficients(self, equation: str, driver: int) -> tuple[str, ...]:
        """Coefficients of other equations as well that a driver of an equation has."""
        if driver == RESISTANCE and equation in electrical.NAMES:
            return ("R",)
        if driver != BACK_EMF or equation not in (*electrical.NAMES, "torque"):
            return ()
        return (*(f"k_{j}" for j in ("abc" if equation == "torque" else equation[-1])), "k")

    def place(self, place: str) -> tuple[str, float]:
        """Equation that a form in a channel or a coefficient is told in, and the scale of its size."""
        quantity, _, phase = place.partition("_")
        if place in COEFFICIENTS:
            return f"electrical_{phase}" if phase else "electrical", COEFFICIENT_SCALE * self._size(quantity)
        noise = next(iter(self.recordings.values())).noise
        name = {"output": "position"}.get(quantity, quantity)
        return "position" if quantity == "output" else f"sensor_{quantity}", STANDS_OUT * float(getattr(noise, name))

    def seen_in(self, place: str, name: str, x: np.ndarray) -> dict[str, np.ndarray]:
        """By equation (column, row): what signals x (column, sample) on a channel, or relative changes x of a
        coefficient, take out of the residuals, each."""
        rec = self.recordings[name]
        off = {n: p.off for n, p in self.parameters.items()}
        if place in COEFFICIENTS:
            quantity, _, phase = place.partition("_")
            of = self._back_emf if quantity == "k" else self._resistance
            return of(State(rec, Point(off, name, ())), phase or "abc", x)
        self.prepare(name, off)
        before = self._recording(off, rec, ())
        step = self.place(place)[1] / STANDS_OUT
        found: dict[str, list[np.ndarray]] = {b.equation: [] for b in before}
        for row in x:
            for b, at in zip(before, self._recording(off, rec.less(place, step * row), ()), strict=True):
                found[b.equation].append((at.residual - b.residual) / step)
        return {e: np.array(rows) for e, rows in found.items() if (place, e) not in self.moving}

    def seen_at(
        self, values: Mapping[str, float], name: str, equation: str, x: np.ndarray, less: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        """(column, row) what signals x (column, sample) on the angle's channel take out of the residuals of one of the
        equations in which that depends on the point: on what the sensor makes of a speed, or on where within an
        interval an edge lies. ``less`` as in ``blocks``."""
        return _seen(State(_less(self.recordings[name], less), Point(values, name, ())), equation, x)

    def _size(self, quantity: str) -> float:
        """Of a coefficient: what its change is told in."""
        return 1.0 if quantity == "k" else self.actuator.resistance

    def _back_emf(self, state: State, phases: str, x: np.ndarray) -> dict[str, np.ndarray]:
        """The same of a relative change of some phases' back-EMF coefficient: in their voltages and in the torque."""
        out: dict[str, np.ndarray] = {"torque": np.zeros((len(x), state.rec.size))}
        for j in map("abc".index, phases):
            k = float(value_of(state.k[j]))
            out |= _in_voltage(state, j, -x * k * np.asarray(state.regressor[j].value))
            drive = k * np.asarray(state.conducting[j].value) * np.asarray(state.current[j].value)
            out["torque"] = out["torque"] + np.array([torque.two_intervals(-row * drive) for row in x])
        return out

    def _resistance(self, state: State, phases: str, x: np.ndarray) -> dict[str, np.ndarray]:
        """The same of a change (ohm) of some phases' resistance: in their voltages."""
        out: dict[str, np.ndarray] = {}
        for j in map("abc".index, phases):
            out |= _in_voltage(state, j, -x * np.asarray(state.current[j].value))
        return out

    def sampled(self, name: str, place: str, less: np.ndarray | None = None) -> dict[str, Any]:
        """What the samples of a recording's channel lie along: those of angles are no means.

        ``less`` : (sample,) what an angle has too much
        """
        rec = self.recordings[name]
        found = self._functions_of(rec)
        if place not in ("angle", "output"):
            return {**found, "averaged": 1}
        angle = rec.angle if place != "angle" or less is None or not len(less) else rec.angle - less
        return found | at_ends(rec, angle)

    def _recording(self, values: Mapping[str, float], rec: Signals, wanted: Collection[str] | None) -> list[Block]:
        state = State(rec, Point(values, rec.name, wanted))
        blocks = []
        for j, (name, r) in enumerate(electrical.residuals(state).items()):
            usable = electrical.usable(state, j) & _known(state, name)
            blocks.append(self._block(state, name, r, electrical.noise_bands(state, j), usable))
        for name, equation in OF_STATE.items():
            if (equation is bus and not bus.shows(rec)) or (equation is sensor_current and rec.adds_up):
                continue
            r = equation.residual(state)
            if equation is commutation:
                if np.size(r.value) <= FEWEST_EDGES:
                    continue
                usable = np.ones(np.size(r.value), bool)
            else:
                usable = equation.usable(state) if hasattr(equation, "usable") else _not_first(rec)
            usable = usable & _known(state, name)
            blocks.append(self._block(state, name, r, equation.noise_bands(state), usable))
        return blocks

    def _block(self, state: State, name: str, r: Dual, bands: list[np.ndarray], usable: np.ndarray) -> Block:
        columns = {**r.slopes, **self._secants(state, name, r, state.p.values)}
        along = self._coordinates(state, name)
        rec = state.rec
        of_angle = rec.angle_step if name in OF_COUNTS else 0.0
        rounded = (rec.output_step if name == "position" else max(rec.current_step, of_angle)) > 0.0
        filters = name == "sensor_speed"
        return Block(state.rec.name, name, np.asarray(r.value), columns, bands, usable, along, rounded, filters)

    def _secants(self, state: State, equation: str, r, values: Mapping[str, float]) -> dict[str, np.ndarray]:
        """Columns of effects that have no derivative at "off": the residual with them less that without."""
        out: dict[str, np.ndarray] = {}
        reach: dict[str, Callable[[State], Dual]] = {
            "sensor_speed": lambda at: -sensor_speed.predicted(at), "torque": torque.residual,
            "position": position.residual,
        }  # fmt: skip
        if equation not in reach:
            return out
        without = None if equation == "sensor_speed" else r
        for unit in self.units:
            for variant in unit.variants:
                for p in variant.parameters:
                    if p.secant is None or not _acts(unit, equation):
                        continue
                    if state.p.wanted is not None and p.name not in state.p.wanted:
                        continue
                    if any(values[n] != self.parameters[n].off for n in p.secant):
                        continue  # at a point where the effect is on, its own derivatives serve
                    if without is None:
                        without = reach[equation](state)
                    at = state.at(Point({**values, **p.secant}, state.rec.name, ()))
                    out[p.name] = np.asarray(reach[equation](at).value) - np.asarray(without.value)
        return out

    def _coordinates(self, state: State, equation: str) -> dict[str, Any]:
        """What the rows of an equation lie along, and a remainder's drivers, at the first point: they hardly move."""
        key = state.rec.name, equation
        if key not in self._along:
            self._along[key] = coordinates_of(state, equation, self._functions_of(state.rec))
        return self._functions_of(state.rec) | self._along[key]

    def _functions_of(self, rec: Signals) -> dict[str, Any]:
        """What the samples of a recording lie along, and the functions that remainders are made of; (sample,) each."""
        if rec.name not in self._functions:
            if self.large:
                self._functions.clear()
            self._functions[rec.name] = functions_of(rec.rows_from)
        return self._functions[rec.name]


def _in_voltage(state: State, j: int, x: np.ndarray) -> dict[str, np.ndarray]:
    """What signals x (column, sample) are in the rows of phase j's equation, by that one's name."""
    if state.rec.current_end is None:
        of = electrical.averaging(state, j)
        x = np.array([of(v) for v in x])
    return {electrical.NAMES[j]: x}


def _seen(state: State, equation: str, x: np.ndarray) -> np.ndarray:
    """(column, row) what ``seen_at`` gives of a recording at a point."""
    if equation == "sensor_speed":
        return np.array([sensor_speed.seen_rate(state, row) for row in x])
    rows = np.concatenate([commutation.rows_of(state, j) for j in range(3)])
    return state.rec.actuator.pole_pairs * x[:, rows] * commutation.by_angle(state)


def _known(state: State, equation: str) -> np.ndarray | bool:
    """(row,) where nothing that an equation needs is cut off, a spike or not recorded, and its channel has a new
    sample."""
    rec = state.rec
    new = rec.new.get(OF_CHANNEL.get(equation, ""), True)
    lost = rec.stalled if equation in ("sensor_speed", "position") else rec.lost
    if not lost.any():
        return new
    of = rows_of(state, equation)
    return (~lost if of is None else of(lost) == 0.0) & new


def _acts(unit: Unit, equation: str) -> bool:
    return equation in unit.equations or (unit.id == "compliance" and equation == "torque")


def _less(rec: Signals, less: Mapping[str, np.ndarray]) -> Signals:
    """A recording without what its channels have too much."""
    for channel, x in less.items():
        rec = rec.less(channel, x)
    return rec


def _not_first(rec: Signals) -> np.ndarray:
    out = np.ones(rec.size, bool)
    out[0] = out[-1] = False
    return out
