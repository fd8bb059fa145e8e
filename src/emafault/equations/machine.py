"""The reference actuator for the diagnosis: its parameters, effects and forms, and its equations at a point."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..diagnosis.model import SETTINGS, Block, Parameter, Unit, Variant
from ..effects import Effect
from ..effects.scaling import scale, scaled
from . import bus, commutation, control, electrical, position, sensor_current, sensor_speed, torque
from .dual import Dual, value_of
from .point import SEEDED, Point, State
from .signals import REST, Signals
from .terms import TERMS

FAULTS = ("Na", "Nb", "Nc", "xi_x", "xi_y")
HEALTHY = 1e-3
SHARED = 0.5  # of the variance of seeded faults, that all seeded recordings have alike (a hierarchical prior)
EDGE_SCATTER = 1e-3  # electrical rad, by which the model of how current passes over may be wrong in a recording
ZERO = 0.5 * REST  # rad of the rotor, by which its angle at rest is known
TIMING = 0.5  # of a control period, by which samples and means within it may be told apart
CURVATURE = 10.0  # times a smooth current's, by which a current at an interval's end is off its neighbours' mean
LEAST_LAG = 0.1  # of an interval, that a lag between channels is worth telling from
BEND = 0.03  # of a channel's full range, that its curve may be off by there
SKEW = 1e-6  # s, by which channels may be sampled apart
SOAK = 0.5  # K, of the measured ambient temperature
GAIN_PRIOR = 0.3  # relative, of the controller's gains
LEVEL = 4  # of the functions of a remainder: the current's
SLOW_FUNCTIONS = (0, 2, 5, 14)  # of the remainder: none, speed, time, temperature
EACH = (0, 1, 2, 5, 16, 17)  # of the remainder, in each recording by itself: constant, direction, speed, time
#: functions of a remainder along one coordinate: speed, current, time and temperature, angle
ALONG = ((0, 1, 2, 3, 15), (0, 4), (0, 5, 14, 16, 17), (0, 6, 7, 8, 9, 10, 11, 12, 13))
OUTSIDE = 4.0  # tolerances, that one value at least of a unit named for its calibration is off by
PER_PHASE = ("a", "b", "c")
#: channels whose faults show in an equation, as what one of its drivers multiplies: a wave of the recorded angle is
#: also one of its rate, times the speed
CHANNELS = {
    ("sensor_speed", 0): ("angle",), ("sensor_speed", 1): ("angle",), ("torque", 0): ("angle",),
    ("position", 0): ("angle", "output"), ("sensor_current", 0): ("current_a", "current_b", "current_c"),
    ("electrical_a", 0): ("current_a",), ("electrical_b", 0): ("current_b",), ("electrical_c", 0): ("current_c",),
}  # fmt: skip
#: equations by name, beside those of the phases
OF_STATE = {
    "sensor_current": sensor_current, "sensor_speed": sensor_speed, "torque": torque, "position": position, "bus": bus,
    "control": control, "commutation": commutation,
}  # fmt: skip
FEWEST_EDGES = 20  # that a recording is asked about its commutations with
SHARE = 0.02  # relative change of the torque constant, for a remainder of the size of the noise
SWEPT = 0.02  # of speed times shape (rad/s), for a driver of the size of one
BACK_EMF = 2  # driver of the electrical equations: speed times the shape
STANDS_OUT = 10.0  # of a channel's noise, for the scale of forms in it
K_SCALE = 0.02  # relative change of a back-EMF coefficient, for the scale of its forms
BEATS = 0.1  # of the rate of runs, below which a wave in their means is not one of their own
LARGE = 400_000  # samples of a bench, from which on what is easily computed anew is kept of one recording at a time


class ReferenceActuator:
    """Recordings of one unit of the reference actuator as the diagnosis sees them."""

    name = "actuator"
    moving = (("angle", "commutation"),)  # channel and equation, what shows of one in the other depends on the point
    bending = ("angle",)  # channels that equations are not linear in

    def __init__(
        self,
        actuator: ActuatorParameters,
        recordings: Mapping[str, Signals],
        exclude: Sequence[str] = (),
        catalogue: Mapping[str, Effect] | None = None,
    ):
        self.actuator = actuator
        self.catalogue = dict(catalogue or scaled(actuator))
        self.recordings = dict(recordings)
        self._disturbed: dict[str, Signals] = {}
        self._along: dict[tuple[str, str], dict[str, Any]] = {}
        self._functions: dict[str, dict[str, Any]] = {}
        self.large = sum(r.size for r in self.recordings.values()) > LARGE
        self.left_out = tuple(exclude)
        self.effects = {k: e for k, e in self.catalogue.items() if k not in exclude}
        self.parameters = self._nuisances()
        self.units = [self._unit(e) for e in self.effects.values() if e.id != "speed_quantisation"]
        self.units += self._forms()
        for unit in self.units:
            for p in unit.parameters:
                self.parameters.setdefault(p.name, p)
        for effect in self.catalogue.values():  # one left out of the library is off
            for name, q in _internal(effect, actuator).items():
                full = f"{effect.id}.{name}"
                if full not in self.parameters and effect.id not in self.effects:
                    self.parameters[full] = Parameter(full, q.off, q.off, 0.0, q.units, fixed=True)

    def families(self, equation: str) -> tuple[tuple[int, ...], ...]:
        """Functions of a remainder or an own form that go along one coordinate; none of the controller's equations."""
        return () if equation in SETTINGS else ALONG

    # ---- parameters
    def _nuisances(self) -> dict[str, Parameter]:
        a = self.actuator
        out: dict[str, Parameter] = {}
        for effect in self.catalogue.values():
            for name, p in effect.parameters.items():
                if p.tolerance > 0.0:
                    centre = getattr(a, p.follows) if p.follows else p.nominal
                    full = f"{effect.id}.{name}"
                    out[full] = Parameter(
                        full, centre, centre, p.tolerance * abs(centre), p.units, vanishes=_vanishes(centre)
                    )
        for name in ("position_gain", "speed_gain", "speed_integral_gain", "speed_limit"):
            at = getattr(a, name)
            out[f"controller.{name}"] = Parameter(f"controller.{name}", at, at, GAIN_PRIOR * at, "")
        full = "controller.commutation_time"
        out[full] = Parameter(full, 0.0, 0.0, 2e-5, "s")
        passing = scale("passing_time", a)
        full = "controller.commutation_slope"
        out[full] = Parameter(full, 4e-6 * passing, 4e-6 * passing, 1e-5 * passing, "s/A")
        for name, sd, units in (
            ("speed", 1e-5, "s"),
            ("power", 1e-5 * passing, "s/A"),
            *((f"time_{j}", 1e-6, "s") for j in "abc"),
        ):
            full = f"controller.commutation_{name}"
            out[full] = Parameter(full, 0.0, 0.0, sd, units)
        unknown = False
        for name, rec in self.recordings.items():
            out[f"dT@{name}"] = Parameter(f"dT@{name}", 0.0, 0.0, SOAK, "K")
            for channel in ("voltage", "current"):
                full = f"skew.{channel}@{name}"
                out[full] = Parameter(full, 0.0, 0.0, SKEW / rec.interval, "interval")
            out[f"output_zero@{name}"] = Parameter(f"output_zero@{name}", 0.0, 0.0, ZERO / a.gear_ratio, "rad")
            full = f"controller.timing@{name}"
            out[full] = Parameter(full, 0.0, 0.0, TIMING * a.control_period, "s")
            if rec.current_step > 0.0:  # of slow currents a converter's steps are off by the same again and again
                for j in PER_PHASE:
                    full = f"rounded.{j}@{name}"
                    out[full] = Parameter(full, 0.0, 0.0, rec.current_step / np.sqrt(12.0), "A")
            for j in PER_PHASE if rec.current_end is None else ():
                out[f"ends.{j}@{name}"] = Parameter(f"ends.{j}@{name}", 0.0, 0.0, CURVATURE, "1")
            for j in PER_PHASE:
                full = f"controller.edge_{j}@{name}"
                out[full] = Parameter(full, 0.0, 0.0, EDGE_SCATTER, "rad")
            if rec.health == "seeded":
                for f in FAULTS:  # how large a bench seeds them is not known beforehand
                    common = _fault(SEEDED + f, f)
                    out[SEEDED + f] = replace(common, sd=common.sd * np.sqrt(SHARED))
                    own = common.sd * np.sqrt(1.0 - SHARED)
                    out[f"{f}@{name}"] = replace(common, name=f"{f}@{name}", mean=0.0, sd=own)
            elif rec.health == "healthy":
                for f in FAULTS:
                    out[f"{f}@{name}"] = Parameter(f"{f}@{name}", 0.0, 0.0, 0.5 * HEALTHY, "1")
            else:
                unknown = True
        if unknown:
            for f in FAULTS:
                out[f] = replace(_fault(f, f), absent=0.5 * HEALTHY)
        return out

    def _unit(self, effect: Effect) -> Unit:
        parameters, positive = [], []
        if effect.kind == "calibration":
            for name, p in effect.parameters.items():
                full = f"{effect.id}.{name}"
                base = self.parameters[full]
                width = _width(p.nominal, p.low, p.high) * (base.off / p.nominal)
                parameters.append(
                    Parameter(full + "+", 0.0, 0.0, width, p.units, alias=full, vanishes=_vanishes(base.off))
                )
            hole = [OUTSIDE * self.parameters[p.alias or ""].sd / p.sd for p in parameters]
            return Unit(effect.id, "calibration", effect.equations, [Variant(parameters, (), min(hole), hole)])
        internal = _internal(effect, self.actuator)
        for name, q in internal.items():
            full = f"{effect.id}.{name}"
            parameters.append(Parameter(full, q.off, q.mean, q.sd, q.units, vanishes=_vanishes(q.off)))
            positive.append(_sign(effect, name, q.off))
        shapes = _shapes(effect, self.actuator)
        least = max((0.5 * _nearest(effect, n) / q.sd for n, q in internal.items()), default=0.0)
        variants = [Variant(parameters, positive, least)] if not shapes else []
        for n, shape in enumerate(shapes):
            full = f"{effect.id}#{n}"
            near = (n > 0 and effect.id != "stribeck") or effect.id == "compliance"
            mean, sd = (1.0, 0.5) if near else (0.0, 2.0)
            parameter = Parameter(full, 0.0, mean, sd, "1", secant={f"{effect.id}.{k}": v for k, v in shape.items()})
            variants.append(Variant([parameter], [0 if near else 1]))
        return Unit(effect.id, effect.kind, effect.equations, variants, Variant(parameters, positive, least))

    def observed(self) -> dict[str, dict[str, float]]:
        """Effects that the recordings show for certain, with their parameters: a speed that lies on a lattice."""
        steps = [r.speed_step for r in self.recordings.values()]
        least = self.catalogue["speed_quantisation"].parameters["step"].low
        if "speed_quantisation" in self.effects and min(steps) >= 0.5 * least:
            return {"speed_quantisation": {"step": float(np.median(steps))}}
        return {}

    def _forms(self) -> list[Unit]:
        out = []
        for channel in ("voltage", "current", "output"):  # the speed's is in the catalogue
            variants = [
                Variant([Parameter(f"lag.{channel}_{side}", 0.0, 0.0, 1.0, "interval")], [1], LEAST_LAG)
                for side in ("late", "early")
            ]
            out.append(Unit(f"~lag_{channel}", "form", (f"sensor_{channel}",), variants, among=3.0))
        pairs = [(j, q) for j in PER_PHASE for q in PER_PHASE if j != q]
        # one pair: what both others add to a phase together is a gain, for the three add up to nothing
        variants = [Variant([Parameter(f"crosstalk.{j}{q}", 0.0, 0.0, 0.03, "1")]) for j, q in pairs]
        out.append(Unit("~crosstalk_current", "form", ("sensor_current",), variants))
        for channel in ("voltage", "current"):
            of = (channel, *(f"{channel}_{j}" for j in PER_PHASE))
            variants = [Variant([Parameter(f"curve.{c}", 0.0, 0.0, BEND, "1")]) for c in of]
            out.append(Unit(f"~curve_{channel}", "form", (f"sensor_{channel}",), variants, among=2.0))
        for quantity, sd, units in (("current", 0.05, "A"), ("voltage", 0.3, "V")):
            for j in PER_PHASE:
                parameters = [Parameter(f"drift_{quantity}.{j}@{n}", 0.0, 0.0, sd, units) for n in self.recordings]
                drift = Unit(
                    f"~drift_{quantity}_{j}", "form", (f"sensor_{quantity}",), [Variant(parameters)], among=6.0
                )
                out.append(drift)
        return out

    # ---- equations
    def prepare(self, name: str) -> None:
        """Compute once what does not depend on the point, or hardly: coordinates and drivers are those at "off"."""
        if (name, "torque") in self._along:
            return
        point = Point({n: p.off for n, p in self.parameters.items()}, name, ())
        self._recording(point.values, self.recordings[name], ())
        noisy = State(self._noisy(name), point)
        torque.residual(noisy)
        for equation in (e for n, e in self._along if n == name and e not in SETTINGS):
            along = self._along[name, equation]
            along["changes"] = (np.array(self._drivers(noisy, equation)) - along["drivers"]).astype(np.float32)

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
        self.prepare(name)
        rec = self._noisy(name) if disturbed else self.recordings[name]
        return self._recording(values, _less(rec, less or {}), wanted)

    # ---- the measuring chain
    def channels(self, equation: str, driver: int) -> tuple[str, ...]:
        """Channels in which a form of a driver of an equation may lie, rather than in the equation itself."""
        return CHANNELS.get((equation, driver), ())

    def coefficients(self, equation: str, driver: int) -> tuple[str, ...]:
        """Coefficients of other equations as well that a driver of an equation has."""
        return (f"k_{equation[-1]}",) if equation in electrical.NAMES and driver == BACK_EMF else ()

    def place(self, place: str, equation: str) -> tuple[str, float]:
        """Equation that a form in a channel or a coefficient is told in, and the scale of its size."""
        quantity = place.split("_")[0]
        if quantity == "k":
            return equation, K_SCALE
        noise = next(iter(self.recordings.values())).noise
        name = {"output": "position"}.get(quantity, quantity)
        return "position" if quantity == "output" else f"sensor_{quantity}", STANDS_OUT * float(getattr(noise, name))

    def seen_in(self, place: str, name: str, x: np.ndarray) -> dict[str, np.ndarray]:
        """By equation (column, row): what signals x (column, sample) on a channel, or relative changes x of a
        coefficient, take out of the residuals, each."""
        rec = self.recordings[name]
        off = {n: p.off for n, p in self.parameters.items()}
        if place.startswith("k_"):
            return self._back_emf(State(rec, Point(off, name, ())), "abc".index(place[-1]), x)
        self.prepare(name)
        before = self._recording(off, rec, ())
        step = self.place(place, "")[1] / STANDS_OUT
        found: dict[str, list[np.ndarray]] = {b.equation: [] for b in before}
        for row in x:
            for b, at in zip(before, self._recording(off, rec.less(place, step * row), ()), strict=True):
                found[b.equation].append((at.residual - b.residual) / step)
        return {e: np.array(rows) for e, rows in found.items() if (place, e) not in self.moving}

    def seen_at(
        self, values: Mapping[str, float], name: str, x: np.ndarray, less: Mapping[str, np.ndarray]
    ) -> np.ndarray:
        """(column, row) what signals x (column, sample) on the angle's channel take out of the commutations' residuals;
        it depends on the point, on where within an interval an edge lies. ``less`` as in ``blocks``."""
        edges = [f"controller.edge_{j}@{name}" for j in PER_PHASE]
        state = State(_less(self.recordings[name], less), Point(values, name, edges))
        slopes = commutation.residual(state).slopes
        rows = np.concatenate([commutation.rows_of(state, j) for j in range(3)])
        moved = sum((np.asarray(slopes[e]) for e in edges if e in slopes), np.zeros(len(rows)))
        return -self.actuator.pole_pairs * x[:, rows] * moved

    def _back_emf(self, state: State, j: int, x: np.ndarray) -> dict[str, np.ndarray]:
        """The same of a relative change of phase j's back-EMF coefficient: in its voltage and in the torque."""
        rec, k = state.rec, float(value_of(state.k[j]))
        voltage = -x * k * np.asarray(state.regressor[j].value)
        if rec.current_end is None:
            of = electrical.averaging(state, j)
            voltage = np.array([of(v) for v in voltage])
        drive = k * np.asarray(state.conducting[j].value) * np.asarray(state.current[j].value)
        force = np.array([torque.two_intervals(-row * drive) for row in x])
        return {electrical.NAMES[j]: voltage, "torque": force}

    def sampled(self, name: str, place: str) -> dict[str, Any]:
        """What the samples of a recording's channel lie along: those of an angle are taken at an interval's end, where
        the others are means over it."""
        rec = self.recordings[name]
        found = self._functions_of(rec)
        if place not in ("angle", "output"):
            return found
        return {**found, "angle": rec.angle, "rotor_angle": np.mod(rec.angle, 2.0 * np.pi)}

    def _recording(self, values: Mapping[str, float], rec: Signals, wanted: Collection[str] | None) -> list[Block]:
        state = State(rec, Point(values, rec.name, wanted))
        blocks = []
        for j, (name, r) in enumerate(electrical.residuals(state).items()):
            usable = electrical.usable(state, j) & _known(state, name)
            blocks.append(self._block(state, name, r, electrical.noise_bands(state, j), usable))
        for name, equation in OF_STATE.items():
            if equation is bus and rec.bus is None:
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
        return Block(state.rec.name, name, np.asarray(r.value), columns, bands, usable, along)

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
            self._along[key] = self._new_coordinates(state, equation)
        return self._functions_of(state.rec) | self._along[key]

    def _functions_of(self, rec: Signals) -> dict[str, Any]:
        """What the samples of a recording lie along, and the functions that remainders are made of; (sample,) each."""
        if rec.name not in self._functions:
            if self.large:
                self._functions.clear()
            self._functions[rec.name] = self._new_functions(rec.rows_from)
        return self._functions[rec.name]

    def _new_functions(self, rec: Signals) -> dict[str, Any]:
        w = rec.speed / 100.0
        level = np.abs(rec.current).sum(axis=1) / 4.0
        t = rec.time / rec.time[-1] - 0.5
        x = rec.actuator.pole_pairs * rec.middle
        direction = np.where(rec.moving, rec.direction, 0.0)  # at rest its sign is the noise's
        base = {
            "direction": direction, "rotor_speed": rec.speed, "current": 2.0 * level, "time": rec.time,
            "rotor_angle": np.mod(rec.middle, 2 * np.pi), "angle": rec.middle, "output_angle": rec.shaft,
            "temperature": np.full(rec.size, rec.ambient),
        }  # fmt: skip
        phi = [
            np.ones(rec.size), direction, np.abs(w), w * w, level - 0.3, t,
            np.cos(x), np.sin(x), np.cos(2 * x), np.sin(2 * x),
            np.cos(3 * x), np.sin(3 * x), np.cos(rec.middle), np.sin(rec.middle),
            np.full(rec.size, rec.dT_measured / 50.0),
            np.exp(-np.abs(rec.speed) / 8.0), np.cos(4 * np.pi * t), np.sin(2 * np.pi * t),
        ]  # fmt: skip
        return {**base, "phi": np.array(phi)}

    def _new_coordinates(self, state: State, equation: str) -> dict[str, Any]:
        """What is an equation's own: the drivers that a coefficient would multiply, and where its rows are not the
        samples, what they lie along; (row,) each."""
        rec = state.rec
        base = dict(self._functions_of(rec))
        phi = list(base.pop("phi"))
        kinds: dict[str, Any] = {
            "slow": SLOW_FUNCTIONS,
            "each": [f - (equation == "control" and f > LEVEL) for f in EACH],
            "drivers": np.array(self._drivers(state, equation)),
        }
        of = rows_of(state, equation)
        if equation == "torque":
            # the measured acceleration keeps its coefficient: another inertia is another share of the net torque
            kinds["sizes"] = {2: SHARE * typical_torque(rec.actuator), 3: 0.0}
        if equation == "control":
            phi = [f for k, f in enumerate(phi) if k != LEVEL]  # the measured quantity itself
        elif equation.startswith("electrical") and of is not None:
            # what means over runs leave of ripple and commutations beats with both
            kinds |= {"highest_order": 0.5 * rec.actuator.pole_pairs, "highest_frequency": BEATS / electrical.RUN}
        if of is None:
            return kinds
        along = {k: of(v) for k, v in base.items()}
        return {
            **along, "rotor_angle": np.mod(along["angle"], 2.0 * np.pi), "phi": np.array([of(f) for f in phi]), **kinds,
        }  # fmt: skip

    def _drivers(self, state: State, equation: str) -> list[np.ndarray]:
        """(row,) each of the quantities that a coefficient of an equation multiplies, the first of them 1."""
        rec = state.rec
        out = [np.ones(rec.size)]
        if equation.startswith("electrical"):
            j = "abc".index(equation[-1])
            out += [rec.current[:, j], np.asarray(state.regressor[j].value) * SWEPT]
        elif equation == "torque":  # friction, torque constant, inertia
            typical = typical_torque(rec.actuator)
            out += [rec.direction, state.drive / typical, state.net / typical]
        elif equation == "sensor_speed":  # at rest the angle's rate is its noise, which the residual has too
            out += [np.where(rec.moving, rec.speed / 100.0, 0.0)]
        elif equation == "sensor_current":
            balanced = rec.current - rec.current.mean(axis=1, keepdims=True)
            out += [balanced[:, j] for j in range(2)]
        elif equation == "bus":
            out += [state.bus_current]
        elif equation == "position":
            out += [self._functions_of(rec)["direction"], rec.acceleration / 1e3]
        of = rows_of(state, equation)
        if of is not None:
            out = [of(d) for d in out]
        return [*out, control.late(state)] if equation == "control" else out


def typical_torque(actuator: ActuatorParameters) -> float:
    """Torque of two phases at a tenth of the current limit (N m)."""
    return 0.2 * actuator.back_emf * actuator.current_limit


def rows_of(state: State, equation: str) -> Callable[[np.ndarray], np.ndarray] | None:
    """What an equation's rows have of a signal (sample,); None where they are the samples."""
    rec = state.rec
    if equation == "control":
        width = control.block_length(rec)
        return rows_at((np.arange(rec.size // width - 1) + 1) * width)
    if equation == "torque":
        return torque.two_intervals
    if equation == "commutation":
        return rows_at(np.concatenate([commutation.rows_of(state, j) for j in range(3)]))
    if equation.startswith("electrical") and rec.current_end is None:
        return electrical.averaging(state, "abc".index(equation[-1]))
    return None


def _known(state: State, equation: str) -> np.ndarray | bool:
    """(row,) where no current or voltage that an equation needs is cut off."""
    lost = state.rec.lost
    if equation in ("sensor_speed", "position") or not lost.any():
        return True
    of = rows_of(state, equation)
    return ~lost if of is None else of(lost) == 0.0


def rows_at(rows: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Picks rows of a signal."""
    return lambda x: x[rows]


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


def _fault(full: str, component: str) -> Parameter:
    turns = component.startswith("N")
    if turns:  # the winding's turns are what is left of them
        return Parameter(full, 0.0, 0.03, 0.05, "1", vanishes=1.0)
    return Parameter(full, 0.0, 0.0, 0.1, "1")


def _vanishes(off: float) -> float | None:
    """Zero, where a parameter multiplies: one that is not zero when it is off."""
    return 0.0 if off != 0.0 else None


def _nearest(effect: Effect, name: str) -> float:
    """Distance from off at which a parameter's realistic range begins."""
    p = effect.parameters.get(name)
    return max(p.low - p.nominal, p.nominal - p.high, 0.0) if p is not None else 0.0


def _width(nominal: float, low: float, high: float) -> float:
    return 0.6 * max(abs(high - nominal), abs(low - nominal))


class _Internal:
    def __init__(self, off: float, mean: float, sd: float, units: str):
        self.off, self.mean, self.sd, self.units = off, mean, sd, units


def _internal(effect: Effect, actuator: ActuatorParameters) -> dict[str, _Internal]:
    """Parameters that an effect is fitted in, with their priors."""
    own = getattr(TERMS[effect.id], "PARAMETERS", None)
    if own is not None:
        out = {}
        for n, numbers in own.items():
            off, mean, sd = (_factor(effect, n, actuator) * x for x in numbers)
            out[n] = _Internal(off, mean, sd, "")
        return out
    return {
        n: _Internal(p.nominal, p.nominal, _width(p.nominal, p.low, p.high), p.units)
        for n, p in effect.parameters.items()
    }


def _factor(effect: Effect, name: str, actuator: ActuatorParameters) -> float:
    """What a number of an effect's own terms is multiplied by for this actuator."""
    return scale(getattr(TERMS[effect.id], "SCALES", {}).get(name, ""), actuator)


def _shapes(effect: Effect, actuator: ActuatorParameters) -> list[dict[str, float]]:
    """Values of its parameters at which a secant is taken where no derivative at "off" exists."""
    given = getattr(TERMS[effect.id], "SHAPES", ())
    return [{n: _factor(effect, n, actuator) * x for n, x in shape.items()} for shape in given]


def _sign(effect: Effect, name: str, off: float) -> int:
    """+1 or -1 where a parameter's range lies on one side of where the fit has it off, which need not be the
    catalogue's nominal value."""
    p = effect.parameters.get(name)
    if p is None:
        return 1 if name in ("heating_rate", "flexibility") else 0
    if p.low >= off and p.high > off:
        return 1
    if p.high <= off and p.low < off:
        return -1
    return 0
