"""What a blind case is and how it is drawn: the unit, its effects and faults, and the bench of recordings made of it.

A case is a pure function of its rung and seed; one of T3 is that of T1 with its effect left out of the library, on the
same recordings. One with something unlisted beside effects (T7) or another controller (T9) has a plain twin without it.
Successive seeds go through the effects in order; rounds go through strata of the amplitude, each effect beginning
elsewhere, so that a single round already holds weak and strong cases and any ``strata`` rounds are balanced.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from ..effects import EFFECTS, Effect
from ..errors import InputError
from .disturbances import FILTER, Unlisted, draw_controller, draw_unlisted, in_physics
from .population import REFERENCE, Population

RUNGS = ("T0", "T1", "T2", "T3", "T4", "T7", "T8", "T9")
#: rungs that are drawn for any actuator; what the others hold has the reference actuator's sizes
OWN_RUNGS = ("T0", "T1", "T2", "T3")
FIRST = 5  # rungs that there were before the others; their noise keeps its seeds
#: of ten seeds of T7: how many effects and how many things unlisted
MIXES = ((1, 1),) * 5 + ((2, 1),) * 2 + ((1, 2),) * 2 + ((2, 2),)
STRATA = {"T1": 20, "T4": 5}  # amplitude strata per effect
#: smallest amplitude of an effect, as a fraction of its realistic maximum: a third of what a typical bench shows at a
#: squared distance of 25 (measured on other seeds), so that every effect's cases begin below the noise
SMALLEST = {
    "angle_offset": 0.0016,
    "back_emf_shape": 0.0035,
    "cogging": 0.01,
    "contact_resistance": 0.03,
    "current_gain": 0.003,
    "current_offset": 0.0014,
    "dynamic_eccentricity": 0.008,
    "friction_asymmetry": 0.0016,
    "friction_temperature": 0.001,
    "hall_displacement": 0.001,
    "inductance_saturation": 0.009,
    "load_constant": 0.001,
    "load_spring": 0.0035,
    "speed_latency": 0.001,
    "speed_scale": 0.0035,
    "stribeck": 0.018,
    "voltage_gain": 0.1,
}
USUAL_SMALLEST = 0.01
#: parameters that say how an effect looks, not how strong it is: uniform over their range, whatever the amplitude
SHAPE_PARAMETERS = {("dynamic_eccentricity", "psi"), ("self_heating", "Rth"), ("stribeck", "w_s"), ("compliance", "C")}
STRONG = (0.10, 0.20)  # largest N_j and |xi| of strong faults
WEAK = (0.02, 0.03)
HEALTHY = 1e-3  # what "healthy" may still hide
HEALTH_MIXES = (
    ("healthy",),
    ("healthy", "unknown"),
    ("healthy", "seeded"),
    ("unknown",),
    ("seeded",),
    ("healthy", "unknown", "seeded"),
)
HEALTH_ODDS = (0.15, 0.30, 0.20, 0.20, 0.05, 0.10)
INTERVALS = (5e-5, 1e-4, 2e-4, 2.5e-4, 4e-4, 5e-4, 1e-3)  # s
INTERVAL_ODDS = (0.08, 0.17, 0.40, 0.10, 0.08, 0.10, 0.07)
LEAST_UNIT = 0.2  # of the nominal value, that a unit has however wide the tolerance
LENGTHS = ("acceleration", "amplitude", "speed")  # settings of a command that go with the reach of an actuator


@dataclass(frozen=True)
class RecordingPlan:
    """One recording of a bench: what was commanded, how it was recorded, the state of the unit."""

    command: str
    settings: Mapping[str, float]
    duration: float  # s
    interval: float  # s
    health: str
    fault: tuple[float, ...]  # N_a, N_b, N_c, xi_x, xi_y, dT; dT is that of the winding at the start
    theta_0: float  # rad


@dataclass(frozen=True)
class Case:
    """One bench and its truth."""

    rung: str
    seed: int
    effects: Mapping[str, Mapping[str, float]]  # effect -> parameter -> value
    tolerances: Mapping[str, Mapping[str, float]]  # calibration effect -> parameter -> value of this unit
    recordings: tuple[RecordingPlan, ...]
    noise_scale: Mapping[str, float]  # channel -> factor
    end_current: bool  # optional variables present
    bus_voltage: bool
    amplitude: float | None = None  # fraction of the realistic maximum, where one effect was drawn
    strong_faults: bool = False
    left_out: tuple[str, ...] = ()  # effects that the library lacks when this case is diagnosed
    forms: tuple[str, ...] = field(default=())  # effects in their alternative form
    unlisted: tuple[Unlisted, ...] = ()  # what no catalogue lists
    controller: Mapping[str, float] = field(default_factory=dict)  # factors of its settings, or its filter (s)
    plain: bool = False  # the twin without what is unlisted, under the nominal controller
    fixed_step: bool = False  # on the other integrator
    again: int = 0  # the same unit once more: with other noise, or in other recordings

    @property
    def name(self) -> str:
        """Name of the case; it says nothing about the truth."""
        return _opaque(self.rung, self.seed, self.plain)

    @property
    def bench(self) -> str:
        """Name of the bench: one of T3 has that of T1."""
        return _opaque("T1" if self.rung == "T3" else self.rung, self.seed, self.plain)

    @property
    def noise_seed(self) -> int:
        """Seed of the sensors' noise; one of each bench and repetition, a plain twin's is the same."""
        place = RUNGS.index("T1" if self.rung == "T3" else self.rung)
        first = FIRST * self.seed + place if place < FIRST else 2**40 + len(RUNGS) * self.seed + place
        return first + 2**41 * self.again

    def unit(self) -> dict[str, dict[str, float]]:
        """Tolerances and effects together, as the simulation takes them."""
        merged = {k: dict(v) for k, v in self.tolerances.items()}
        for effect, values in self.effects.items():
            merged[effect] = {**merged.get(effect, {}), **values}
        return merged

    def to_dict(self) -> dict:
        """Plain types, for the key."""
        return asdict(self)


def case_from_dict(raw: Mapping) -> Case:
    """Inverse of ``Case.to_dict`` after a round through JSON."""
    fields = dict(raw)
    fields["recordings"] = tuple(RecordingPlan(**{**r, "fault": tuple(r["fault"])}) for r in raw["recordings"])
    fields["left_out"], fields["forms"] = tuple(raw["left_out"]), tuple(raw["forms"])
    fields["unlisted"] = tuple(Unlisted(**u) for u in raw.get("unlisted", ()))
    return Case(**fields)


def _opaque(rung: str, seed: int, plain: bool) -> str:
    """A name from which nobody reads the rung or, by way of the seed, the effect."""
    return hashlib.sha256(f"{rung} {seed} {plain}".encode()).hexdigest()[:12]


def draw_case(rung: str, seed: int, population: Population = REFERENCE) -> Case:
    """Draw the case of a rung and seed, of the units of an actuator.

    Raises
    ------
    InputError : an unknown rung, or one that is of the reference actuator alone
    """
    if rung not in RUNGS:
        raise InputError(f"rung: got '{rung}', accepted are {', '.join(RUNGS)}")
    if population is not REFERENCE and rung not in OWN_RUNGS:
        raise InputError(f"rung: got '{rung}', accepted for an actuator of one's own are {', '.join(OWN_RUNGS)}")
    if rung == "T3":
        return without_effect(draw_case("T1", seed, population))
    rng = np.random.default_rng([RUNGS.index(rung), seed])
    ids = list(EFFECTS)
    effects: dict[str, dict[str, float]] = {}
    amplitude: float | None = None
    strong = False
    unlisted: tuple[Unlisted, ...] = ()
    controller: dict[str, float] = {}
    if rung == "T0":
        strong = seed % 2 == 1
    elif rung == "T2":
        kind = seed % 10  # five of ten hold two effects, two hold three, three hold one with strong faults
        strong = kind >= 7
        for effect in rng.choice(ids, size=1 if strong else 2 if kind < 5 else 3, replace=False):
            effects[str(effect)] = draw_effect(str(effect), 10.0 ** rng.uniform(-1.0, 0.0), rng, population.catalogue)
    elif rung in ("T7", "T8", "T9"):
        if rung == "T9":
            controller, number = draw_controller(seed // 2, rng), seed % 2
        else:
            number, others = MIXES[seed % len(MIXES)] if rung == "T7" else (0, 1)
            unlisted = draw_unlisted(others, seed, rng)
        for effect in _different(seed // 2 if rung == "T9" else seed, number, rng):
            share = 10.0 ** rng.uniform(-1.0, 0.0)
            amplitude = share if number == 1 else None
            effects[effect] = draw_effect(effect, share, rng)
    else:
        effect = ids[seed % len(ids)]
        stratum = stratum_of(seed, rung)
        smallest = SMALLEST.get(effect, USUAL_SMALLEST)
        amplitude = smallest ** (1.0 - (stratum + rng.random()) / STRATA[rung])
        effects[effect] = draw_effect(effect, amplitude, rng, population.catalogue)
    return Case(
        rung=rung,
        seed=seed,
        effects=effects,
        tolerances=draw_tolerances(rng, population.catalogue),
        recordings=draw_bench(strong, rng, population.reach),
        noise_scale={c: float(s) for c, s in _noise_scale(rng).items()},
        end_current=bool(rng.random() > 0.15),
        bus_voltage=bool(rng.random() > 0.15),
        amplitude=amplitude,
        strong_faults=strong,
        forms=tuple(effects) if rung == "T4" else (),
        unlisted=unlisted,
        controller=controller,
        fixed_step=in_physics(unlisted) or FILTER in controller,
    )


def in_other_noise(case: Case, again: int) -> Case:
    """The same bench recorded once more."""
    return replace(case, again=again)


def in_other_recordings(case: Case, again: int) -> Case:
    """The same unit in recordings of its own: other motions, temperatures, health and intervals."""
    rng = np.random.default_rng([RUNGS.index(case.rung), case.seed, again])
    return replace(case, recordings=draw_bench(case.strong_faults, rng), again=again)


def without_effect(case: Case) -> Case:
    """The case of T3 on the bench of one of T1."""
    return replace(case, rung="T3", left_out=tuple(case.effects))


def plain_twin(case: Case) -> Case:
    """The same bench without what is unlisted and under the nominal controller."""
    return replace(case, unlisted=(), controller={}, plain=True)


def is_disturbed(case: Case) -> bool:
    """Whether a case holds something unlisted or another controller."""
    return bool(case.unlisted or case.controller)


def with_twin(case: Case) -> tuple[Case, ...]:
    """A case and, where it is compared with its plain twin, that one: T7 and T9."""
    return (case, plain_twin(case)) if case.rung in ("T7", "T9") else (case,)


def _different(turn: int, number: int, rng: np.random.Generator) -> list[str]:
    """Effects of a case: the first goes through the catalogue by turns, others are drawn."""
    ids = list(EFFECTS)
    first = ids[turn % len(ids)]
    rest = rng.choice([e for e in ids if e != first], max(0, number - 1), replace=False)
    return [first, *(str(e) for e in rest)][:number]


def stratum_of(seed: int, rung: str) -> int:
    """Amplitude stratum of a seed, 0 the weakest."""
    turn, effect = divmod(seed, len(EFFECTS))
    return (turn + 7 * effect) % STRATA[rung]


def draw_tolerances(rng: np.random.Generator, catalogue: Mapping[str, Effect] = EFFECTS) -> dict[str, dict[str, float]]:
    """Values of the calibration parameters of a unit within its specification."""
    return {
        effect.id: {
            name: p.nominal * max(1.0 + p.tolerance * float(rng.standard_normal()), LEAST_UNIT)
            for name, p in effect.parameters.items()
            if p.tolerance > 0.0
        }
        for effect in catalogue.values()
        if effect.kind == "calibration"
    }


def draw_effect(
    effect: str, amplitude: float, rng: np.random.Generator, catalogue: Mapping[str, Effect] = EFFECTS
) -> dict[str, float]:
    """Draw the parameters of one effect.

    ``amplitude`` is the fraction of the realistic maximum that the largest of its parameters takes; one whose realistic
    range starts away from zero goes log-uniformly over that range instead. A calibration effect has no amplitude: at
    least one parameter is outside four sigma.
    """
    parameters = catalogue[effect].parameters
    if catalogue[effect].kind == "calibration":
        while True:
            values = {n: float(rng.uniform(p.low, p.high)) for n, p in parameters.items()}
            if any(abs(values[n] - p.nominal) > 4.0 * p.tolerance * abs(p.nominal) for n, p in parameters.items()):
                return values
    amplitudes = [n for n in parameters if (effect, n) not in SHAPE_PARAMETERS]
    pattern = rng.uniform(0.0, 1.0, len(amplitudes))
    pattern[rng.integers(len(amplitudes))] = 1.0
    position = max(
        0.0, 1.0 - np.log(amplitude) / np.log(SMALLEST.get(effect, USUAL_SMALLEST))
    )  # 0 at the smallest amplitude, 1 at the realistic maximum
    values = {}
    for name, p in parameters.items():
        if name not in amplitudes:
            values[name] = float(rng.uniform(p.low, p.high))
        elif p.low <= p.nominal <= p.high:
            reach = p.high - p.nominal if p.high > p.nominal else p.low - p.nominal
            if p.low < p.nominal < p.high and rng.random() < 0.5:
                reach = p.low - p.nominal
            values[name] = float(p.nominal + amplitude * pattern[amplitudes.index(name)] * reach)
        else:
            near, far = (p.low, p.high) if p.low > p.nominal else (p.high, p.low)
            values[name] = float(near * (far / near) ** position)
    return values


def draw_bench(strong: bool, rng: np.random.Generator, reach: float = 1.0) -> tuple[RecordingPlan, ...]:
    """Draw four to eight recordings: commands, lengths, intervals, ambient temperatures and states of health.

    ``reach`` multiplies the speeds and lengths of the commands.
    """
    count = int(rng.integers(4, 9))
    mix = HEALTH_MIXES[rng.choice(len(HEALTH_MIXES), p=HEALTH_ODDS)]
    if strong and mix == ("healthy",):
        mix = ("healthy", "unknown")
    health = [*mix, *rng.choice(mix, count - len(mix))]
    largest = STRONG if strong else WEAK
    common = _draw_fault(largest, rng) if strong or rng.random() < 0.5 else np.zeros(5)
    levels = rng.uniform(-50.0, 70.0, int(rng.integers(2, 5)))
    while np.ptp(levels) < 20.0:
        levels = rng.uniform(-50.0, 70.0, len(levels))
    temperature = [*levels[:2], *rng.choice(levels, count - 2)]
    rng.shuffle(temperature)
    common_interval = _draw_interval(rng)
    mixed = rng.random() < 0.4
    plans = []
    for n in range(count):
        duration = round(float(rng.uniform(0.4, 1.0)), 2)
        interval = _draw_interval(rng) if mixed else common_interval
        command, settings = _draw_command(duration, rng)
        state = str(health[n])
        if state == "healthy":
            fault = _draw_fault((HEALTHY, HEALTHY), rng)
        elif state == "unknown":
            fault = common
        else:
            fault = _draw_fault(largest, rng)
        plans.append(
            RecordingPlan(
                command=command,
                settings={k: v * reach if k in LENGTHS else v for k, v in settings.items()},
                duration=interval * round(duration / interval),
                interval=interval,
                health=state,
                fault=tuple(float(x) for x in [*fault, temperature[n]]),
                theta_0=float(rng.uniform(0.0, 2.0 * np.pi)),
            )
        )
    order = rng.permutation(count)
    return tuple(plans[n] for n in order)


def _draw_fault(largest: tuple[float, float], rng: np.random.Generator) -> np.ndarray:
    radius, direction = largest[1] * rng.random(), rng.uniform(-np.pi, np.pi)
    return np.array([*(largest[0] * rng.random(3)), radius * np.cos(direction), radius * np.sin(direction)])


def _draw_interval(rng: np.random.Generator) -> float:
    """Mostly round figures, now and then any whole number of microseconds (s)."""
    if rng.random() < 0.15:
        return round(float(np.exp(rng.uniform(np.log(5e-5), np.log(1e-3)))), 6)
    return float(rng.choice(INTERVALS, p=INTERVAL_ODDS))


def _draw_command(duration: float, rng: np.random.Generator) -> tuple[str, dict[str, float]]:
    """A command that moves within the end stops and the speed limit."""
    sign = float(rng.choice((-1.0, 1.0)))
    name = str(rng.choice(("parabolic", "ramp", "step", "sine", "chirp", "reversal"), p=(0.3, 0.1, 0.1, 0.2, 0.1, 0.2)))
    speed = float(np.exp(rng.uniform(np.log(0.05), np.log(0.5))))  # rad/s at the output
    settings: dict[str, float]
    if name == "parabolic":
        settings = {"acceleration": sign * float(rng.uniform(0.15, 0.7))}
    elif name == "ramp":
        settings = {"speed": sign * min(speed, 0.4 / duration)}
    elif name == "step":
        settings = {"amplitude": sign * float(rng.uniform(0.003, 0.05)), "time": float(rng.uniform(0.01, 0.08))}
    elif name == "sine":
        frequency = float(rng.uniform(1.0, 6.0))
        settings = {"amplitude": sign * min(speed / (2.0 * np.pi * frequency), 0.3), "frequency": frequency}
    elif name == "chirp":
        low, high = float(rng.uniform(0.5, 2.0)), float(rng.uniform(4.0, 12.0))
        settings = {"amplitude": sign * speed / (2.0 * np.pi * high), "frequency_start": low, "frequency_end": high}
    else:
        settings = {"amplitude": speed * duration / float(rng.uniform(2.2, 8.0)), "speed": speed}
    return name, settings


def _noise_scale(rng: np.random.Generator) -> dict[str, float]:
    bench = np.exp(rng.uniform(np.log(0.5), np.log(2.0)))
    channels = ("voltage", "current", "current_end", "speed", "angle", "position", "bus_voltage")
    return {channel: bench * rng.uniform(0.8, 1.25) for channel in channels}
