"""What the equations are fitted in: nuisances, effects and faults of the measuring chain, with their priors."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..actuator.parameters import ActuatorParameters
from ..diagnosis.model import TOLERANCES, Parameter, Unit, Variant
from ..effects import Effect
from ..effects.scaling import scale
from ..switches import TURN
from . import acquisition, commutation, position, rounding
from .coordinates import typical_torque
from .point import SEEDED
from .sensor_speed import SENSOR
from .signals import REST, Signals
from .terms import TERMS

FAULTS = ("Na", "Nb", "Nc", "xi_x", "xi_y")
HEALTHY = 1e-3
EDGE = 2e-4  # electrical rad, systematic error of the modelled angle of commutation, seen with sixty recordings
SHARED = 0.5  # of the variance of seeded faults, that all seeded recordings have alike (a hierarchical prior)
ZERO = 0.5 * REST  # rad of the rotor, by which its angle at rest is known
TIMING = 0.5  # of a control period, by which samples and means within it may be told apart
LEAST_LAG = 0.1  # of an interval, that a lag between channels is worth telling from
#: ways of coming late that someone has chosen, with what is the least; an average is over two samples at least
MADE = {"smoothed": LEAST_LAG, "filtered": LEAST_LAG, "butterworth": LEAST_LAG, "averaged": 0.5}
TALK = 0.03  # of its range, that a channel may take up of another's
BEND = 0.03  # of a channel's full range, that its curve may be off by there
DEAD = 0.005  # of the current limit, that a current sensor may be dead within
DROP = 0.02  # of the supply, that voltages may lack of the switches' drop
FAR_OUT = 100.0  # of a channel's noise, for the scale of its offset
WARM = 30.0  # K, by which a machine may not have the recorded ambient temperature
GAIN = 0.02  # relative, by which a channel's gain may change from one recording to the next, or along one
CLOCK = 1e-3  # relative, by which a logger's clock may be slow or fast
SKEW = 1e-6  # s, by which channels may be sampled apart
AMBIENT = 0.5  # K, of the measured ambient temperature
GAIN_PRIOR = 0.3  # relative, of the controller's gains
PER_PHASE = ("a", "b", "c")
BEYOND = "~tolerance_"  # of the name of a form, before the effect whose quantities lie beyond their tolerance
#: equations that a channel's faults show in, beside the one that is named after it
IN = {"voltage": ("electrical",), "output": ("position",), "angle": ("sensor_speed",), "bus_voltage": ("bus",)}
GAINED = ("current", "voltage", "output")  # quantities whose gain may be off
LISTED_OFFSET = ("current", "angle", "bus_voltage")  # those of which an offset that stays is in the catalogue
#: gains of the controller with their units
GAINS = {"position_gain": "1/s", "speed_gain": "A s/rad", "speed_integral_gain": "A/rad"}
OF_LAW = {**GAINS, "speed_limit": "rad/s"}  # what the control equation has of the controller
#: of what an effect is fitted in that its catalogue does not have
UNITS = {"flexibility": "rad/(N m)"}


def nuisances(
    a: ActuatorParameters, catalogue: Mapping[str, Effect], recordings: Mapping[str, Signals]
) -> dict[str, Parameter]:
    """What is free whatever the cause: tolerances, settings of the controller, temperatures, the fault vector."""
    out: dict[str, Parameter] = {}
    for effect in catalogue.values():
        for name, p in effect.parameters.items():
            if p.tolerance > 0.0:
                centre = getattr(a, p.follows) if p.follows else p.nominal
                full = f"{effect.id}.{name}"
                out[full] = Parameter(
                    full, centre, centre, p.tolerance * abs(centre), p.units, vanishes=_vanishes(centre)
                )
    for name, units in OF_LAW.items():
        at = getattr(a, name)
        out[f"controller.{name}"] = Parameter(f"controller.{name}", at, at, GAIN_PRIOR * at, units)
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
    for j in PER_PHASE:
        full = f"controller.edge_{j}"
        out[full] = Parameter(full, 0.0, 0.0, EDGE, "rad")
    unknown = False
    for name, rec in recordings.items():
        out[f"dT@{name}"] = Parameter(f"dT@{name}", 0.0, 0.0, AMBIENT, "K")
        for channel in ("voltage", "current"):
            full = f"skew.{channel}@{name}"
            out[full] = Parameter(full, 0.0, 0.0, SKEW / rec.interval, "interval")
        zero = np.hypot(ZERO / a.gear_ratio, 0.5 * rec.output_step)  # counts may be cut off or rounded
        out[f"output_zero@{name}"] = Parameter(f"output_zero@{name}", 0.0, 0.0, zero, "rad")
        if rec.zero_error > 0.0:
            out[f"zero@{name}"] = Parameter(f"zero@{name}", 0.0, 0.0, rec.zero_error, "rad")
        full = f"controller.bias@{name}"
        out[full] = Parameter(full, 0.0, 0.0, FAR_OUT * rec.noise.speed, "rad/s")
        full = f"controller.timing@{name}"
        out[full] = Parameter(full, 0.0, 0.0, TIMING * a.control_period, "s")
        for full, k, _ in rounding.harmonics("counts", name) if rec.output_step > 0.0 else ():
            out[full] = Parameter(full, 0.0, 0.0, rec.output_step / (np.sqrt(2.0) * np.pi * k), "rad")
        for full, sd in rounding.names_of(rec).items():
            out[full] = Parameter(full, 0.0, 0.0, sd, "A")
        for full in (n for j in range(3) for n in commutation.passing(j, name)):
            out[full] = Parameter(full, 0.0, 0.0, commutation.ripple_time(a), "s")
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


def unit_of(effect: Effect, actuator: ActuatorParameters, known: Mapping[str, Parameter]) -> Unit:
    """An effect as a candidate cause; ``known``: the nuisances, of which a unit's calibration is another value."""
    parameters, positive = [], []
    if effect.kind == "calibration":
        for name, p in effect.parameters.items():
            full = f"{effect.id}.{name}"
            base = known[full]
            width = _width(p.nominal, p.low, p.high) * (base.off / p.nominal)
            parameters.append(Parameter(full + "+", 0.0, 0.0, width, p.units, alias=full, vanishes=_vanishes(base.off)))
        hole = [TOLERANCES * known[p.alias or ""].sd / p.sd for p in parameters]
        return Unit(effect.id, "calibration", effect.equations, [Variant(parameters, (), min(hole), hole)])
    own = internal(effect, actuator)
    for name, q in own.items():
        full = f"{effect.id}.{name}"
        parameters.append(Parameter(full, q.off, q.mean, q.sd, q.units, vanishes=_vanishes(q.off)))
        positive.append(_sign(effect, name, q.off))
    shapes = _shapes(effect, actuator)
    least = max((0.5 * _nearest(effect, n) / q.sd for n, q in own.items()), default=0.0)
    variants = [Variant(parameters, positive, least)] if not shapes else []
    for n, shape in enumerate(shapes):
        full = f"{effect.id}#{n}"
        near = (n > 0 and effect.id != "stribeck") or effect.id == "compliance"
        mean, sd = (1.0, 0.5) if near else (0.0, 2.0)
        parameter = Parameter(full, 0.0, mean, sd, "1", secant={f"{effect.id}.{k}": v for k, v in shape.items()})
        variants.append(Variant([parameter], [0 if near else 1]))
    return Unit(effect.id, effect.kind, effect.equations, variants, Variant(parameters, positive, least))


def beyond_tolerance(
    effects: Sequence[Effect], actuator: ActuatorParameters, known: Mapping[str, Parameter]
) -> list[Unit]:
    """Forms of what is calibrated of a unit and the library at hand does not list: it is in the equations all the same,
    within its tolerance, and no fit may take it beyond without a word."""
    of = [e for e in effects if e.kind == "calibration"]
    units = [unit_of(e, actuator, known) for e in of]
    return [replace(u, id=BEYOND + u.id, kind="form", among=float(len(of))) for u in units]


def measuring_chain(
    a: ActuatorParameters, recordings: Mapping[str, Signals], reference: str, lacking: Collection[str] = ()
) -> list[Unit]:
    """Faults of the measuring chain with parameters of their own: lag, crosstalk, curves, drop, drift, gain.

    Parameters
    ----------
    reference : the recording that gains of all phases alike are told against in the others
    lacking : effects that the library does not have
    """
    out = []
    phases = [f"{quantity}_{j}" for quantity in ("voltage", "current") for j in PER_PHASE]
    # an angle is a sample, and no mean that a logger smooths; of currents the equations take what is recorded, from
    # which an average or a filter of the second order cannot be undone
    only = {
        "speed": ("late", "early", "filtered", "butterworth", "averaged"), "angle": ("late", "early"),
        "current": ("late", "early", "smoothed", "filtered"),
    }  # fmt: skip
    only |= dict.fromkeys(phases, acquisition.OF_ONE_PHASE)
    # the controller takes the speed behind its sensor; that this one filters is in the catalogue, and by less than an
    # interval a record does not tell a delay from a filter
    filters = "speed_latency" not in lacking
    channels = ("voltage", "current", "output", "speed", "angle", "bus_voltage", *phases)
    for channel in channels:
        ways = only.get(channel, ("late", "early", *MADE))
        variants = [_late(channel, way) for way in ways]
        if channel == "speed":
            variants += (
                [_late(SENSOR, "late", 1.0)] if filters else [_late(SENSOR, way) for way in ("late", "filtered")]
            )
        shows = _shows(channel.partition("_")[0] if channel in phases else channel)
        among = float(len(channels))
        out.append(Unit(f"~lag_{channel}", "form", shows, variants, among=among, alike=bool(set(MADE) & set(ways))))
    out += _clocks(recordings)
    pairs = [(j, q) for j in PER_PHASE for q in PER_PHASE if j != q]
    # one pair: what both others add to a phase together is a gain, for the three add up to nothing
    for quantity in ("current", "voltage"):
        variants = [Variant([Parameter(f"crosstalk_{quantity}.{j}{q}", 0.0, 0.0, TALK, "1")]) for j, q in pairs]
        if quantity == "current":
            sd = TALK * a.current_limit / a.bus_voltage
            variants += [
                Variant([Parameter(f"pickup.{c}", 0.0, 0.0, sd, "A/V")])
                for c in ("current", *(f"current_{j}" for j in PER_PHASE))
            ]
        out.append(Unit(f"~crosstalk_{quantity}", "form", _shows(quantity), variants, among=2.0))
    at = TURN * a.current_limit
    turns = {k: [Parameter(f"{k}.turn", at, at, at, "A", vanishes=0.0)] for k in ("drop", "dead")}
    curves = {
        "curve": (BEND, "1"), "halves": (BEND, "1"), "drop": (DROP * a.bus_voltage, "V"),
        "dead": (DEAD * a.current_limit, "A"),
    }  # fmt: skip
    bends = {("curve", "voltage"): ("curve", "halves"), ("curve", "current"): ("curve", "halves", "dead")}
    if any(r.current_step > 0.0 for r in recordings.values()):  # where a step takes small currents for none as well
        bends["curve", "current"] = ("curve",)
    for (word, channel), kinds in (bends | {("drop", "voltage"): ("drop",)}).items():
        of = (channel, *(f"{channel}_{j}" for j in PER_PHASE))
        variants = [
            Variant([Parameter(f"{k}.{c}", 0.0, 0.0, *curves[k]), *turns.get(k, ())]) for k in kinds for c in of
        ]
        out.append(Unit(f"~{word}_{channel}", "form", _shows(channel), variants, among=3.0))
    return out + _drifts(a, recordings, reference)


def _clocks(recordings: Collection[str]) -> list[Unit]:
    """Loggers that have channels of their own, with a clock that is not that of the others; one of several channels may
    be late by another amount in each recording, beside it or instead."""
    out = []
    for of, channels in acquisition.CLOCKS.items():
        both = [acquisition.clock_names(of, n) for n in recordings]
        starts = [Parameter(start, 0.0, 0.0, 1.0, "interval") for start, _ in both]
        rate = Parameter(both[0][1], 0.0, 0.0, CLOCK, "1")
        shows = tuple(dict.fromkeys(e for c in channels for e in _shows(c)))
        variants = [Variant([rate])]
        if len(channels) > 1:  # of one channel, a share of an interval is a lag first of all
            variants += [Variant(starts), Variant([*starts, rate])]
        out.append(Unit(f"~clock_{of}", "form", shows, variants, among=float(len(acquisition.CLOCKS))))
    return out


def _late(channel: str, way: str, least: float = 0.0) -> Variant:
    """A way in which a channel comes late, or early, by at least so many intervals."""
    least = max(least, MADE.get(way, 0.0))
    parameter = Parameter(f"lag.{channel}_{way}", 0.0, 0.0, 1.0, "interval")
    return Variant([parameter], [1], max(least, LEAST_LAG), [least] if least else ())


def _shows(channel: str) -> tuple[str, ...]:
    return (f"sensor_{channel}", *IN.get(channel, ()))


def _drifts(a: ActuatorParameters, recordings: Mapping[str, Signals], reference: str) -> list[Unit]:
    """Channels whose offset grows, in all recordings alike or along each, or is another one in each, or whose gain is;
    and a scale of the output position that is off; a temperature and a load that are others in each recording.

    A current's offset that is always the same is in the catalogue, and so are the bus voltage's, a
    constant load and the speed's scale.
    """
    out = []
    others = [n for n in recordings if n != reference]
    noise = next(iter(recordings.values())).noise
    longest = max(r.size * r.interval for r in recordings.values())
    each_of = float(len(acquisition.DRIFTS) + 2)  # the machine's temperature and its load among them
    for quantity, units in acquisition.DRIFTS.items():
        sd = FAR_OUT * float(getattr(noise, {"output": "position"}.get(quantity, quantity)))
        phases = PER_PHASE if quantity in ("current", "voltage") else ("all",)
        for j in phases:
            always = Parameter(f"offset_{quantity}.{j}", 0.0, 0.0, sd, units)
            rate = Parameter(f"{acquisition.RATE}_{quantity}.{j}", 0.0, 0.0, sd / longest, f"{units}/s")
            each, along = (
                [Parameter(f"{kind}_{quantity}.{j}@{n}", 0.0, 0.0, sd, units) for n in recordings]
                for kind in ("offset", "drift")
            )
            variants = [Variant(along), Variant(each), Variant([*each, *along]), Variant([rate])]
            if quantity == "angle":  # one that grew by another amount in each would be a clock's at an even speed
                variants = [Variant(each), Variant([rate])]
            unit = f"~drift_{quantity}_{j}" if len(phases) > 1 else f"~drift_{quantity}"
            variants += [Variant([always]), Variant([always, rate])] if quantity not in LISTED_OFFSET else []
            # evenly over the quantities, then over a quantity's phases and its gain
            among = each_of * (len(phases) + 1 if quantity in GAINED else 1)
            shows = ("bus",) if quantity == "bus_voltage" else _shows(quantity)  # the supply's as well as its channel's
            out.append(Unit(unit, "form", shows, variants, among=among))
        if len(phases) > 1 and others:
            # what all phases' gains have in common in all recordings is the unit's own calibration, but for their drift
            level, growth = acquisition.GAIN_NAMES
            gains = [
                Variant([Parameter(f"{kind}_{quantity}.{j}@{n}", 0.0, 0.0, GAIN, "1") for n in of])
                for kind, of_all in ((level, others), (growth, recordings))
                for j, of in (("all", of_all), *((j, recordings) for j in phases))
            ]
            out.append(Unit(f"~gain_{quantity}", "form", _shows(quantity), gains, among=among))
        if quantity == "output":
            scales = [Variant([Parameter(f"gain_output.{whose}", 0.0, 0.0, GAIN, "1")]) for whose in position.SCALED]
            out.append(Unit("~scale_output", "form", _shows(quantity), scales, among=among))
    # that the machine is warm of a motion before, or the thermometer elsewhere
    warm = [Parameter(f"ambient.start@{n}", 0.0, 0.0, WARM, "K") for n in recordings]
    out.append(Unit("~ambient", "form", ("electrical",), [Variant(warm)], among=each_of))
    loads = [Parameter(f"load.each@{n}", 0.0, 0.0, typical_torque(a), "N m") for n in recordings]
    out.append(Unit("~load", "form", ("torque",), [Variant(loads)], among=each_of))
    return out


def controller(a: ActuatorParameters) -> list[Unit]:
    """What a controller may do that the nominal one does not: filter its command, feed the command's speed forward."""
    loop = 1.0 / a.position_gain  # s, of the position's loop
    of = {
        "filter": Parameter("command.filter", 0.0, 0.0, loop, "s"),
        "feedforward": Parameter("command.feedforward", 0.0, 0.0, 1.0, "1"),
    }
    return [Unit(f"~controller_{name}", "form", ("control",), [Variant([p], [1])]) for name, p in of.items()]


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


@dataclass(frozen=True)
class Internal:
    """A parameter that an effect is fitted in: its value when off, its prior's mean and standard deviation."""

    off: float
    mean: float
    sd: float
    units: str


def internal(effect: Effect, actuator: ActuatorParameters) -> dict[str, Internal]:
    """Parameters that an effect is fitted in, with their priors."""
    own = getattr(TERMS[effect.id], "PARAMETERS", None)
    if own is not None:
        out = {}
        for n, numbers in own.items():
            off, mean, sd = (_factor(effect, n, actuator) * x for x in numbers)
            known = effect.parameters.get(n)
            out[n] = Internal(off, mean, sd, known.units if known else UNITS.get(n, "1"))
        return out
    return {
        n: Internal(p.nominal, p.nominal, _width(p.nominal, p.low, p.high), p.units)
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
