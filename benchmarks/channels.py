"""Diagnoses of benches whose channels come in coarse steps, are noisier than the reference's, filtered, computed of
duty cycles or another in each recording, whose controller does more with its command, or on which several things turn
or pull that no catalogue lists.

    python benchmarks/channels.py [--only "encoder of 4096 counts" ...]

Six recordings of 0.6 s of one unit a bench, once without effect, once with a contact resistance in phase a, once with
Stribeck friction. Printed for each: what was named, what was told beside it and what the channels are, and what of
that was not. All noise is that of voltages, currents, speed and positions; the sensors' filter that of voltages,
currents and speed.
"""

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import butter, lfilter

from diagnosis import Case, simulate_bench
from emafault import config
from emafault.actuator.parameters import ActuatorParameters
from emafault.equations.run import diagnose_bench
from emafault.io.bench import read_bench
from emafault.io.recording import Recording, read_recording, write_recording
from emafault.io.rows import of_rows
from emafault.resampled import before

EFFECTS = {
    "none": (), "contact_resistance": ("effects.contact_resistance.R_x_a=0.04",),
    "stribeck": ("effects.stribeck.a=0.02",),
}  # fmt: skip
SPEC = config.diagnosis_spec(config.compose())
NOISY = ("voltage", "current", "current_end", "speed", "angle", "position")


def in_steps(place: str, step: float) -> tuple[str, ...]:
    """Overrides by which a channel comes in steps."""
    return (f"unlisted=[{{place: {place}, form: adc_step, step: {step}}}]",)


def noisier(factor: float, *channels: str) -> tuple[str, ...]:
    """Overrides by which channels, or all, have so many times their noise."""
    return tuple(f"sensors.{n}={factor * SPEC['sensors'][n]:g}" for n in channels or NOISY)


def entry(place: str, form: str, **numbers: float) -> tuple[str, ...]:
    """Overrides by which a form acts at a place."""
    return entries((place, form, numbers))


def entries(*several: tuple[str, str, dict[str, float]]) -> tuple[str, ...]:
    """Overrides by which several forms act, each at a place with its numbers."""
    each = [
        f"place: {p}, form: {f}, {', '.join(f'{n}: {x:g}' for n, x in numbers.items())}" for p, f, numbers in several
    ]
    return (f"unlisted=[{', '.join(f'{{{e}}}' for e in each)}]",)


@dataclass(frozen=True)
class Channel:
    """What a bench's channels or controller are like.

    ``itself``: form and equation that it is told as; ``listed``: what it is of the catalogue; ``change``: of a
    recording and its number, after the simulation; ``of``: overrides of a recording's own, by its number.
    """

    overrides: tuple[str, ...] = ()
    itself: tuple[str, ...] = ()
    listed: tuple[str, ...] = ()
    change: Callable[[Recording, int], Recording] | None = None
    of: Callable[[int], tuple[str, ...]] | None = None


def changed(*itself: str, **of: Callable[[np.ndarray, int], np.ndarray]) -> Channel:
    """Channels that are a function of themselves and the recording's number."""
    return Channel(
        itself=itself,
        change=lambda r, n: replace(r, **{name: f(getattr(r, name), n) for name, f in of.items()}),
    )


def each(n: int) -> float:
    """Another number in each recording, within one."""
    return float(np.sin(2.0 * n + 1.0))


def spiked(size: float) -> Callable[[np.ndarray, int], np.ndarray]:
    """Three samples of a signal that stand out."""

    def of(x: np.ndarray, n: int) -> np.ndarray:
        rng, out = np.random.default_rng(n), x.copy()
        out[rng.choice(np.arange(10, len(x) - 10, 5), 3, replace=False)] += size * rng.uniform(0.5, 1.0, 3)
        return out

    return of


def plus_on_b(size: float) -> Callable[[np.ndarray, int], np.ndarray]:
    return lambda x, n: x + size * each(n) * np.array([0.0, 1.0, 0.0])


def into_a(share: float) -> Callable[[np.ndarray, int], np.ndarray]:
    """What phase a's channel takes up of phase b."""
    return lambda x, n: x + share * np.outer(x[:, 1], [1.0, 0.0, 0.0])


def late(share: float) -> Callable[[np.ndarray, int], np.ndarray]:
    """A signal that lags by a share of an interval."""
    return lambda x, n: np.concatenate([x[:1], (1.0 - share) * x[1:] + share * x[:-1]])


def both(
    first: Callable[[np.ndarray, int], np.ndarray], then: Callable[[np.ndarray, int], np.ndarray]
) -> Callable[[np.ndarray, int], np.ndarray]:
    return lambda x, n: then(first(x, n), n)


def standing_still(r: Recording, n: int) -> Recording:
    """A recorder that repeats one sample of every channel 25 times."""
    names = ("phase_voltage", "phase_current", "phase_current_end", "bus_voltage", "rotor_speed", "rotor_angle")
    at = int(np.random.default_rng(n).integers(200, len(r.time) - 200))
    out = {name: getattr(r, name).copy() for name in (*names, "output_position") if getattr(r, name) is not None}
    for x in out.values():
        x[at : at + 25] = x[at]
    return replace(r, **out)


def with_missing_rows(r: Recording, n: int) -> Recording:
    """A logger that has dropped five rows in each of two places."""
    lost = [np.arange(at, at + 5) for at in np.random.default_rng(n).integers(200, len(r.time) - 200, 2)]
    return of_rows(r, np.delete(np.arange(len(r.time)), np.concatenate(lost)))


def with_rows_twice(r: Recording, n: int) -> Recording:
    """A logger that has written one row of a hundred twice, and dropped the last ones for it."""
    twice = np.random.default_rng(n).random(len(r.time)) < 0.01
    return of_rows(r, np.repeat(np.arange(len(r.time)), 1 + twice)[: len(r.time)])


def with_two_sensors(r: Recording, n: int) -> Recording:
    """A third current that is less the sum of the two that are measured."""
    of = {name: getattr(r, name) for name in ("phase_current", "phase_current_end")}
    return replace(r, **{name: np.column_stack([x[:, :2], -x[:, :2].sum(axis=1)]) for name, x in of.items()})


def with_a_loud_current(r: Recording, n: int) -> Recording:
    """The current of phase b with three more times the noise that it has."""
    rng = np.random.default_rng(n)
    of_b = np.array([0.0, 1.0, 0.0])
    return replace(
        r, phase_current=r.phase_current + 0.02 * rng.standard_normal((len(r.time), 3)) * of_b,
        phase_current_end=r.phase_current_end + 0.06 * rng.standard_normal((len(r.time), 3)) * of_b,
    )  # fmt: skip


def with_averaged_noise(r: Recording, n: int) -> Recording:
    """A speed whose noise is a moving average, as that of a differentiator."""
    noise = np.random.default_rng(n).standard_normal(len(r.time) + 4)
    return replace(r, rotor_speed=r.rotor_speed + 0.3 * np.convolve(noise, np.ones(5), "valid") / np.sqrt(5.0))


def in_turn(i: np.ndarray, n: int) -> np.ndarray:
    """Currents of phases b and c that are sampled by 0.1 and 0.2 intervals late."""
    before = np.concatenate([i[:1], i[:-1]])
    return i + np.array([0.0, 0.1, 0.2]) * (before - i)


def held(x: np.ndarray, every: int) -> np.ndarray:
    """A signal of which every so many samples one is new."""
    return x[np.arange(len(x)) // every * every]


def joined(x: np.ndarray, every: int) -> np.ndarray:
    """The same with straight lines in between."""
    at = np.arange(len(x))
    return np.interp(at, at[::every], x[::every])


def bent(i: np.ndarray) -> np.ndarray:
    """Currents of channels that are 1 % low at 5 A, with the square of the current."""
    return i * (1.0 - 0.002 * np.abs(i))


def times(size: float) -> Callable[[np.ndarray, int], np.ndarray]:
    return lambda x, n: x * (1.0 + size * each(n))


def growing(size: float) -> Callable[[np.ndarray, int], np.ndarray]:
    """A gain that is off by a size at the recording's end."""
    return lambda x, n: x * (1.0 + size * np.linspace(0.0, 1.0, len(x)))[:, None]


def warming(size: float) -> Callable[[np.ndarray, int], np.ndarray]:
    """An offset of phase a that settles at a size, with a time constant of a quarter of the recording."""
    return lambda x, n: x + np.outer(size * (1.0 - np.exp(-np.linspace(0.0, 4.0, len(x)))), [1.0, 0.0, 0.0])


def with_hum(r: Recording, n: int) -> Recording:
    """All voltages with one wave of 50 Hz, whose phase is another in each recording."""
    return replace(r, phase_voltage=r.phase_voltage + 0.2 * np.sin(2.0 * np.pi * 50.0 * r.time + 2.0 * n)[:, None])


def with_hum_of_currents(r: Recording, n: int) -> Recording:
    """Each current with a wave of 50 Hz of its own phase, which is another one in each recording."""
    wave = 0.03 * np.sin(2.0 * np.pi * 50.0 * r.time[:, None] + n + np.array([0.3, 2.0, 4.5]))
    return replace(r, phase_current=r.phase_current + wave, phase_current_end=r.phase_current_end + wave)


def with_hum_of_the_angle(r: Recording, n: int) -> Recording:
    """An angle with a wave of 50 Hz, whose phase is another in each recording."""
    return replace(r, rotor_angle=r.rotor_angle + 5e-4 * np.sin(2.0 * np.pi * 50.0 * r.time + n))


def along_itself(x: np.ndarray, n: int) -> np.ndarray:
    """An output position with a wave of 60 urad about every 26 mrad of its own."""
    return x + 6e-5 * np.sin(2.0 * np.pi * x / 0.0262 + 0.4)


def losing_counts(x: np.ndarray, n: int) -> np.ndarray:
    """An angle whose encoder loses four of 4096 counts, at another time in each recording."""
    return x + 4.0 * 2.0 * np.pi / 4096 * (np.arange(len(x)) > 1000 + 700 * n)


def late_by_recording(x: np.ndarray, n: int) -> np.ndarray:
    """A signal that is up to an interval late, by another share in each recording."""
    return before(x, np.full(len(x), 0.5 + 0.5 * each(n)))


def dead(i: np.ndarray, n: int) -> np.ndarray:
    """Currents of channels that are dead within 50 mA."""
    return np.sign(i) * np.maximum(np.abs(i) - 0.05, 0.0)


def half_waves(i: np.ndarray, n: int) -> np.ndarray:
    """Currents of which phase a's channel has another gain in one direction."""
    return i * (1.0 + 0.01 * (i > 0.0) * np.array([1.0, 0.0, 0.0]))


def averaged(x: np.ndarray, over: int) -> np.ndarray:
    """A signal averaged over a sample and some before."""
    return uniform_filter1d(x, over, axis=0, origin=(over - 1) // 2, mode="nearest")


def with_counted_speed(r: Recording, n: int) -> Recording:
    """A speed that is the difference of recorded angles eight intervals apart."""
    before = np.concatenate([np.full(8, r.rotor_angle[0]), r.rotor_angle[:-8]])
    return replace(r, rotor_speed=(r.rotor_angle - before) / (8.0 * r.interval))


def with_voltages_in_currents(r: Recording, n: int) -> Recording:
    """Currents whose channels take up 0.5 mA a volt of their phase."""
    return replace(
        r, phase_current=r.phase_current + 5e-4 * r.phase_voltage,
        phase_current_end=r.phase_current_end + 5e-4 * r.phase_voltage,
    )  # fmt: skip


CHANNELS = {
    "currents in steps of 20 mA": Channel(in_steps("current", 0.02), ("adc_step in sensor_current",)),
    "currents in steps of 50 mA": Channel(in_steps("current", 0.05), ("adc_step in sensor_current",)),
    "voltages in steps of 0.1 V": Channel(in_steps("voltage", 0.1), ("adc_step in sensor_voltage",)),
    "bus voltage in steps of 0.1 V": Channel(in_steps("bus_voltage", 0.1), ("adc_step in bus",)),
    "encoder of 4096 counts": Channel(in_steps("angle", 1.534e-3)),
    "output in counts of 0.1 mrad": Channel(in_steps("output", 1e-4), ("adc_step in position",)),
    "all noise a tenth": Channel(noisier(0.1)),
    "all noise five times": Channel(noisier(5.0)),
    "all noise ten times": Channel(noisier(10.0)),
    "voltages' noise ten times": Channel(noisier(10.0, "voltage")),
    "speed's noise ten times": Channel(noisier(10.0, "speed")),
    "angle's noise ten times": Channel(noisier(10.0, "angle")),
    "currents late by half an interval": Channel(entry("current", "lag", lag=0.5), ("lag in sensor_current",)),
    "angle late by half an interval": Channel(entry("angle", "lag", lag=0.5), ("lag in sensor_angle",)),
    "currents smoothed": Channel(entry("current", "smoothing", delay=0.4), ("lag in sensor_current",)),
    "voltages smoothed": Channel(entry("voltage", "smoothing", delay=0.4), ("lag in sensor_voltage",)),
    "voltages of duty cycles": Channel(
        entry("voltage", "drop", drop=0.7, turn=0.1), ("sensor_curve in sensor_voltage",)
    ),
    "sensors' filter of 5 kHz": Channel(
        ("recording.filter={kind: first_order, cutoff: 5000, before_noise: true}",),
        ("lag in sensor_current", "lag in sensor_voltage"),
        listed=("speed_latency",),
    ),
    "filter of the command": Channel(
        entry("command", "command_filter", time_constant=0.005), ("controller in control",)
    ),
    "feed-forward": Channel(entry("command", "feedforward", gain=0.5), ("controller in control",)),
    "offset of a current by recording": changed(
        "drift in sensor_current", phase_current=plus_on_b(0.02), phase_current_end=plus_on_b(0.02)
    ),
    "gain of the currents by recording": changed(
        "drift in sensor_current", phase_current=times(0.01), phase_current_end=times(0.01)
    ),
    "gain of the voltages by recording": changed("drift in sensor_voltage", phase_voltage=times(0.01)),
    "gain of the currents that drifts": changed(
        "drift in sensor_current", phase_current=growing(0.01), phase_current_end=growing(0.01)
    ),
    "hum of all voltages": Channel(itself=("frequency in sensor_voltage",), change=with_hum),
    "offset of a current that warms up": changed(
        "drift in sensor_current", phase_current=warming(0.05), phase_current_end=warming(0.05)
    ),
    "scale of the output position": changed("sensor_curve in sensor_output", output_position=lambda x, n: 1.003 * x),
    "gain of a phase's voltage by recording": changed(
        "drift in sensor_voltage", phase_voltage=lambda v, n: v * (1.0 + 0.01 * each(n) * np.array([0.0, 0.0, 1.0]))
    ),
    "voltage of phase b in that of a": changed("crosstalk in sensor_voltage", phase_voltage=into_a(0.01)),
    "offset of the speed": changed("drift in sensor_speed", rotor_speed=lambda w, n: w + 0.8),
    "zero of the output position": changed("drift in sensor_output", output_position=lambda x, n: x + 8e-4),
    "spikes of the motion": changed(
        "spikes in position", "spikes in sensor_speed", "spikes in sensor_angle",
        output_position=spiked(0.05), rotor_speed=spiked(100.0), rotor_angle=spiked(20.0),
    ),
    "recorder that stands still for 5 ms": Channel(
        itself=("held in sensor_current", "held in sensor_voltage", "held in bus", "held in position"),
        change=standing_still,
    ),
    "ten rows missing": Channel(
        itself=("held in sensor_current", "held in sensor_voltage", "held in bus", "held in position"),
        change=with_missing_rows,
    ),
    "one row of a hundred twice": Channel(change=with_rows_twice),
    "two current sensors": Channel(change=with_two_sensors),
    "speed new in one sample of five": changed("held in sensor_speed", rotor_speed=lambda w, n: held(w, 5)),
    "output joined by lines over five": changed("held in position", output_position=lambda x, n: joined(x, 5)),
    "one current's noise fourfold": Channel(change=with_a_loud_current),
    "current of phase b late by 0.3 intervals": Channel(
        entry("current_b", "lag", lag=0.3), ("lag in sensor_current",)
    ),
    "currents sampled one after the other": changed(
        "lag in sensor_current", phase_current=in_turn, phase_current_end=in_turn
    ),
    "speed's noise averaged over five samples": Channel(noisier(0.02, "speed"), change=with_averaged_noise),
    "angle new in one sample of five": changed(rotor_angle=lambda x, n: held(x, 5)),
    "hum of the currents": Channel(itself=("frequency in sensor_current",) * 3, change=with_hum_of_currents),
    "angle that loses four counts of 4096": changed("step_change in sensor_angle", rotor_angle=losing_counts),
    "hum of the angle": Channel(itself=("frequency in sensor_angle",), change=with_hum_of_the_angle),
    "output with a wave along itself": changed("order in position", output_position=along_itself),
    "output of a bent sensor": changed("function in position", output_position=lambda x, n: x + 0.4 * x**3),
    "angle with small spikes": changed("spikes in sensor_angle", rotor_angle=spiked(0.1)),
    "instants of the angle that scatter by 10 us": Channel(
        entry("angle", "clock", scatter=1e-5), ("clock in sensor_angle",)
    ),
    "positions of a clock 200 ppm slow": Channel(entry("positions", "clock", rate=2e-4), ("clock in sensor_angle",)),
    "positions late by recording": changed(
        "clock in sensor_angle", rotor_angle=late_by_recording, output_position=late_by_recording
    ),
    "back-EMF that goes down with the current": Channel(
        (
            "unlisted=[{place: back_emf, form: function, along: current, from: 0.0, to: 6.0, "
            "values: [0.0, -0.004, -0.017, -0.039, -0.069, -0.108]}]",
        ),
        ("coefficient in electrical",),
    ),
    "inductance of phase b 3 % low": Channel(
        entry("winding", "coefficient", inductance_b=-0.03), ("coefficient in electrical",)
    ),
    "three waves of a bearing": Channel(
        entries(*(
            ("torque", "order", {"order": 3.57 * k, "amplitude": 0.005 - 0.001 * k, "phase": k}) for k in (1, 2, 3)
        )),
        ("order in torque",) * 3,
    ),
    "waves of 42 and of 41 a turn": Channel(
        entries(
            ("torque", "order", {"order": 42.0, "amplitude": 0.004, "phase": 0.3}),
            ("torque", "order", {"order": 41.0, "amplitude": 0.0015, "phase": 1.0}),
        ),
        ("order in torque",) * 2,
    ),
    "load for 0.15 s": Channel(
        entry("torque", "pulse", jump=0.03, time=0.2, until=0.35), ("step_change in torque",)
    ),
    "gust of the load": Channel(
        (
            "unlisted=[{place: torque, form: function, along: time, from: 0.15, to: 0.45, "
            "values: [0.0, -0.007, -0.018, -0.018, -0.007, 0.0]}]",
        ),
        ("function in torque",),
    ),
    "load that stiffens with the cube": Channel(
        (
            "unlisted=[{place: torque, form: function, along: output_angle, from: -0.2, to: 0.2, "
            "values: [0.96, 0.20736, 0.00768, -0.00768, -0.20736, -0.96]}]",
        ),
        ("function in torque",),
    ),
    "drag beyond a place of the travel": Channel(
        (
            "unlisted=[{place: drag, form: function, along: output_angle, from: 0.02, to: 0.0201, "
            "values: [0.0, 0.003, 0.006, 0.009, 0.012, 0.015]}]",
        ),
        ("coefficient in torque",),
    ),
    "brake that drags off": Channel(
        ("unlisted=[{place: drag, form: memory, source: decay, gain: 0.08, time_constant: 0.02}]",),
        ("memory in torque",),
    ),
    "angle homed by recording": changed("drift in sensor_angle", rotor_angle=lambda x, n: x + 0.02 * each(n)),
    "angle that drifts": changed(
        "drift in sensor_angle", rotor_angle=lambda x, n: x + 0.02 * np.linspace(0.0, 1.0, len(x))
    ),
    "bus voltage by recording": changed("drift in bus", bus_voltage=lambda v, n: v + 0.8 * each(n)),
    "bus voltage that drifts": changed(
        "drift in bus", bus_voltage=lambda v, n: v + 0.3 * np.linspace(0.0, 1.0, len(v))
    ),
    "load by recording": Channel(
        itself=("drift in torque",), of=lambda n: (f"effects.load_constant.T={2.0 * each(n)}",)
    ),
    "terminal loose for 0.1 s": Channel(
        entry("resistance_b", "pulse", jump=0.2, time=0.2, until=0.3), ("step_change in electrical_b",)
    ),
    "machine warm of motions before": changed(
        "drift in electrical", ambient_temperature=lambda x, n: x - 3.0 * n
    ),
    "currents of sensors dead within 50 mA": Channel(
        entry("current", "sensor_curve", dead=0.05), ("sensor_curve in sensor_current",)
    ),
    "currents' channels dead within 50 mA": changed(
        "sensor_curve in sensor_current", phase_current=dead, phase_current_end=dead
    ),
    "half-waves of a current unlike": changed(
        "sensor_curve in sensor_current", phase_current=half_waves, phase_current_end=half_waves
    ),
    "voltages in the currents": Channel(
        itself=("crosstalk in sensor_current",), change=with_voltages_in_currents,
    ),
    "currents averaged over three samples": changed(
        "lag in sensor_current",
        phase_current=lambda i, n: averaged(i, 3), phase_current_end=lambda i, n: averaged(i, 3),
    ),
    "speed behind a Butterworth filter of 200 Hz": changed(
        "lag in sensor_speed", rotor_speed=lambda w, n: w[0] + lfilter(*butter(2, 200.0, fs=5000.0), w - w[0])
    ),
    "speed counted over eight intervals": Channel(itself=("lag in sensor_speed",), change=with_counted_speed),
    "speed averaged over nine samples": changed("lag in sensor_speed", rotor_speed=lambda w, n: averaged(w, 9)),
    "three faults at once": changed(
        "drift in sensor_current", "lag in sensor_voltage", "lag in sensor_output",
        phase_current=plus_on_b(0.02), phase_current_end=plus_on_b(0.02), phase_voltage=late(0.4),
        output_position=late(0.6),
    ),
    "four faults at once": changed(
        "drift in sensor_current", "crosstalk in sensor_current", "lag in sensor_voltage", "lag in sensor_output",
        phase_current=both(plus_on_b(0.02), into_a(0.01)), phase_current_end=both(plus_on_b(0.02), into_a(0.01)),
        phase_voltage=late(0.4), output_position=late(0.6),
    ),
    "four others at once": Channel(
        itself=(
            "sensor_curve in sensor_current", "crosstalk in sensor_voltage", "drift in sensor_speed",
            "spikes in position",
        ),
        change=lambda r, n: replace(
            r, phase_current=bent(r.phase_current), phase_current_end=bent(r.phase_current_end),
            phase_voltage=into_a(0.01)(r.phase_voltage, n), rotor_speed=r.rotor_speed + 0.8,
            output_position=spiked(0.05)(r.output_position, n),
        ),
    ),
}  # fmt: skip


def main() -> None:
    """Simulate, diagnose, print a line a bench and how many are right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=CHANNELS, default=list(CHANNELS), metavar="CHANNEL")
    args = parser.parse_args()
    right = clean = count = 0
    with tempfile.TemporaryDirectory() as scratch:
        for channel in args.only:
            for effect, overrides in EFFECTS.items():
                folder = Path(scratch) / f"{channel} {effect}"
                folder.mkdir()
                this = CHANNELS[channel]
                simulate_bench(folder, Case(6, 0.6, (*overrides, *this.overrides), of=this.of))
                for n, file in enumerate(sorted(folder.iterdir()) if this.change else ()):
                    write_recording(file, this.change(read_recording(file), n))
                verdict = diagnose_bench(read_bench(folder, ActuatorParameters(**SPEC["actuator"])), SPEC).verdict
                named = verdict["which"][0]["effects"]
                told = [f"{d['form']} in {d['equation']}" for d in verdict["discovered"]]
                lacking, told = (
                    list((Counter(a) - Counter(b)).elements()) for a, b in ((this.itself, told), (told, this.itself))
                )
                wanted = {*([] if effect == "none" else [effect]), *this.listed}
                count, right = count + 1, right + (set(named) == wanted)
                clean += not told and not lacking
                beside = f"; beside it {', '.join(told)}" if told else ""
                beside += f"; not told: {', '.join(lacking)}" if lacking else ""
                p = verdict["which"][0]["probability"]
                print(f"{channel}, {effect}: {' + '.join(named) or 'none'} ({p:.2f}){beside}", flush=True)
    print(f"{right} of {count} right, all that the channels are told and nothing else in {clean}")


if __name__ == "__main__":
    main()
