"""The reference actuator as the diagnosis sees it: statistics by simulation with the actuator's own compiled model."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import uniform_filter1d

from ..actuator.commands import jumps_of, resample, with_corners
from ..actuator.conduction import LANES
from ..actuator.parameters import RUN_DTYPE, ActuatorParameters, make_runs
from ..actuator.sensors import SensorNoise
from ..actuator.simulate import simulate_each, ways
from ..effects import EFFECTS
from ..faults import FAULT_NAMES
from ..gap.twin import Cell
from ..recording import Recording
from .actuator_layout import COMMUTATION_AT, LATTICE, PER_PHASE, SIZE, SPECIFICATION, SPEED_AT, SUM_I_AT, cells_of
from .actuator_noise import CHANNELS, channel_spread, covariance_by_channel, noise_covariance
from .actuator_parameters import derive, derive_together, hypotheses_of, parameters_of, report, weights_together
from .actuator_statistics import Computed, Nominal, compute

MINIMUM_COUNT = 15  # samples behind a statistic that is used
NOISE_PAIRS = 4  # of noise and its negative, over which its bias of the statistics is averaged
ROUNDED_ALIKE = 20  # samples
RATE_SPAN = 1e-3  # s, over which the angle's rate is averaged to tell which way a motion goes
JITTER_REPEATS = 8
TOGETHER = 0.5  # share of the scatter that its repeats' own correlations are believed for
HUNTING = 3.0  # on the variance of what hunts: trusted as far as its repeats scatter, it leads fits astray
FIRST_REPEATS = 4  # where a fit starts
COMMAND_SCATTER = 2e-5  # rad, over which a motion that hunts about its target goes another way
MOMENT_SCATTER = 0.1  # of the interval in which a step of the command came
EARLIEST = 0.02  # of that interval; the sample before it still has the old command
COMMUTATION_FLOOR = 0.007  # of the share of current around a commutation: what averaging over few of them leaves
RIPPLE_SCATTER = 2e-3  # relative, of the comparator's band, over which the ripple falls differently
RIPPLE_UNKNOWN = 1e-2  # the same where no current at an instant tells the inductance and so the ripple's frequency
START_SCATTER = 2e-4, 2e-3  # rad, least and most over which commutations fall differently between recording instants
SMOOTHED = 25  # samples over which the angle's noise is averaged before
ASTRAY = 3.0  # times the angle by which recording and simulation go apart, over which they do
BIAS_TRUST = 0.05  # relative error of the correction for noise inside the regressors
#: statistics that the ripple outweighs, with rare large values, where only mean currents are recorded
RIPPLED = [m for m, s in enumerate(SPECIFICATION) if s[0] in ("5th harmonic", "7th harmonic")]
#: statistics of the three phases, (phase, statistic)
ALIKE = (
    np.arange(3 * PER_PHASE).reshape(3, -1),
    np.arange(SUM_I_AT + 1, SUM_I_AT + 4).reshape(3, 1),
    np.arange(SUM_I_AT + 4, SUM_I_AT + 7).reshape(3, 1),
    np.arange(COMMUTATION_AT, SIZE).reshape(3, -1),
)


Rounding = Callable[[np.ndarray], np.ndarray]


def rounding_of(speeds: Sequence[tuple[np.ndarray, np.ndarray, float]], step: float) -> Rounding:
    """How the sensor rounds speeds to multiples of ``step`` (rad/s): to the nearest, down, or towards zero.

    Told by the mean error against the angle's rate in either direction, over all recordings: where a speed stays
    between the same two steps, one recording alone tells little.

    Parameters
    ----------
    speeds : speed (time,) in rad/s, angle (time,) in rad and interval (s) of each recording
    """
    ways: dict[float, list[np.ndarray]] = {1.0: [], -1.0: []}
    for speed, angle, interval in speeds:
        rate = np.diff(angle) / interval
        error = (speed[1:] - rate) / step
        steady = uniform_filter1d(rate, max(1, round(RATE_SPAN / interval)))
        for way, errors in ways.items():
            errors.append(error[way * steady > step])
    seen = {way: np.concatenate(errors) for way, errors in ways.items()}

    def misfit(expected: Mapping[float, float]) -> float:
        return sum(len(e) * (float(np.mean(e)) - expected[way]) ** 2 for way, e in seen.items() if len(e))

    found: Rounding = np.round
    least = misfit({1.0: 0.0, -1.0: 0.0})
    for rounding, expected in ((np.floor, {1.0: -0.5, -1.0: -0.5}), (np.trunc, {1.0: -0.5, -1.0: 0.5})):
        if misfit(expected) < least:
            found, least = rounding, misfit(expected)
    return found


@dataclass
class _Brought:
    """One recording as brought, with what depends on it alone."""

    recording: Recording
    signals: dict
    nominal: Nominal
    command: np.ndarray
    jumps: np.ndarray  # (jump, 2) last sample before and first after each step of the command
    computed: Computed
    usable: np.ndarray  # (statistic,) bool
    noise: dict[str, float]  # of the bench, by channel
    theta_0: float
    moment: float | None = None  # at which a step of the command came, from the sample before it to that after
    variances: dict[str, float] = field(default_factory=dict)  # of this recording's channels, as last compared
    by_channel: dict[str, np.ndarray] | None = None  # covariance of the statistics under unit noise
    unit_noise: list[dict[str, np.ndarray]] = field(default_factory=list)  # draws by channel, as often as they serve
    jitter: np.ndarray | None = None  # (statistic,) variance from where the switching falls
    start_scatter: float = START_SCATTER[1]  # rad


@dataclass(frozen=True)
class _Task:
    """A run to compare with a recording; its command (tick+1,) if not the recording's, and how far that is off."""

    name: str
    run: np.void
    command: np.ndarray | None = None
    offset: float = 0.0


class ActuatorTwin:
    """Twin of the reference actuator for a bench of recordings.

    Parameters
    ----------
    actuator : nominal parameters
    recordings : by name
    noise : noise of the sensors where a recording does not tell it
    exclude : effects left out of the library
    threads : simulations run side by side
    """

    name = "actuator"
    noise_floor = 0.85  # median on the confirm recordings of the effect-free development cases

    def __init__(
        self,
        actuator: ActuatorParameters,
        recordings: Mapping[str, Recording],
        noise: SensorNoise,
        exclude: Sequence[str] = (),
        threads: int = 2,
    ):
        self.actuator = actuator
        self.threads = threads
        self.sensor_noise = noise
        self._brought = {name: self._bring(recording) for name, recording in recordings.items()}
        self.effects = {id: e for id, e in EFFECTS.items() if id not in exclude}
        self.parameters = parameters_of(actuator, recordings, self.effects)
        self.index = {p.name: m for m, p in enumerate(self.parameters)}
        spacings = [float(b.computed.values[LATTICE]) for b in self._brought.values()]
        self.rounding: Rounding = np.round
        if max(spacings) > 0.0:
            stepped = [b for b, spacing in zip(self._brought.values(), spacings, strict=True) if spacing > 0.0]
            speeds = [(b.signals["rotor_speed"], b.signals["rotor_angle"], b.nominal.interval) for b in stepped]
            self.rounding = rounding_of(speeds, float(np.median([s for s in spacings if s > 0.0])))
        self.hypotheses = hypotheses_of(self.parameters, self.effects, spacings)
        self._offset: dict[str, np.ndarray] = {}
        self._cache: dict[tuple[str, bytes], np.ndarray] = {}
        self._averages: dict[tuple[str, bytes], np.ndarray] = {}

    # ---- the recordings
    def _bring(self, recording: Recording) -> _Brought:
        names = ["phase_voltage", "phase_current", "phase_current_end", "rotor_speed", "rotor_angle"]
        names += ["output_position", "commanded_position", "bus_voltage"]
        signals = {n: np.ascontiguousarray(getattr(recording, n)) for n in names if getattr(recording, n) is not None}
        theta = signals["rotor_angle"]
        rest = np.flatnonzero(np.abs(theta - theta[0]) > 2e-3)
        still = max(1, int(rest[0]) if len(rest) else len(theta))
        theta_0 = float(np.mean(theta[: max(1, still - 1)]))
        nominal = Nominal.of(self.actuator, recording, theta_0)
        jumps = jumps_of(recording.commanded_position)
        command = self._command(recording, jumps)
        computed = compute(nominal, signals, keep=True)
        usable = computed.count >= MINIMUM_COUNT
        if not nominal.has_end:
            usable[RIPPLED] = False
        return _Brought(recording, signals, nominal, command, jumps, computed, usable, {}, theta_0)

    def erratic(self, name: str) -> bool:
        """Whether small changes may change a recording's statistics abruptly: after a step the actuator hunts."""
        return len(self._brought[name].jumps) > 0

    @property
    def names(self) -> list[str]:
        """Names of the recordings."""
        return list(self._brought)

    def duration(self, name: str) -> float:
        """Length of a recording (s)."""
        b = self._brought[name]
        return b.nominal.interval * len(b.recording.time)

    # ---- parameters and hypotheses
    @property
    def derived(self) -> list[str]:
        """Nuisances whose derivatives follow exactly from those of others (see ``derive``)."""
        return ["unit_calibration.k_scale", *(f"{name}.dT" for name in self._brought)]

    def derive(self, name: str, values: np.ndarray, derivative, recording: str) -> np.ndarray:
        """Derivative of one recording's statistics by a parameter that acts only through others."""
        return derive(self.actuator, self.parameters, name, values, derivative, recording)

    def weights_together(self, effect: str, values: np.ndarray) -> np.ndarray | None:
        """(parameter of the effect,) of a change of all its phases whose derivative ``derive_together`` knows."""
        return weights_together(effect, values)

    def derive_together(self, effect: str, values: np.ndarray, derivative, recording: str) -> np.ndarray:
        """Derivative of one recording's statistics by that change, from those by nuisances."""
        return derive_together(self.actuator, self.parameters, effect, values, derivative, recording)

    # ---- statistics
    def cells(self, part: Sequence[str]) -> list[Cell]:
        """Cells of the usable statistics, recording by recording."""
        return [c for name in part for c, u in zip(cells_of(name), self._brought[name].usable, strict=True) if u]

    def observed(self, part: Sequence[str]) -> np.ndarray:
        """(statistic,) statistics of the recordings."""
        return np.concatenate([self._brought[n].computed.values[self._brought[n].usable] for n in part])

    def predict(self, values: np.ndarray, part: Sequence[str]) -> np.ndarray:
        """(point, parameter) -> (point, statistic), by simulation; a point already simulated is remembered."""
        values = np.atleast_2d(values)
        runs = {name: self._runs(values, name) for name in part}
        tasks, seen = [], {}
        for name in part:
            for row in range(len(values)):
                key = (name, runs[name][row].tobytes())
                if key not in self._cache and key not in seen:
                    seen[key] = (name, runs[name][row])
                tasks.append(key)
        new = list(seen.items())

        found = self._statistics([_Task(name, run) for _, (name, run) in new])
        self._cache.update(zip((key for key, _ in new), found, strict=True))
        out = []
        rows = len(values)
        for m, name in enumerate(part):
            b = self._brought[name]
            block = np.array([self._cache[tasks[m * rows + row]] for row in range(rows)])
            out.append((block + self._offset.get(name, 0.0))[:, b.usable])
        return np.concatenate(out, axis=1)

    def _runs(self, values: np.ndarray, name: str) -> np.ndarray:
        """Records of one recording at every parameter point."""
        b = self._brought[name]
        faults = np.zeros((len(values), 6))
        effects: dict[str, dict[str, np.ndarray]] = {}
        for m, p in enumerate(self.parameters):
            if p.fault is not None:
                if name in (p.recordings or ()):
                    faults[:, FAULT_NAMES.index(p.fault)] = values[:, m]
                continue
            effect, parameter = p.name.split(".", 1)
            effects.setdefault(effect, {})[parameter] = values[:, m]
        if "dynamic_eccentricity" in effects:
            x, y = (effects["dynamic_eccentricity"].pop(n) for n in ("d_cos", "d_sin"))
            effects["dynamic_eccentricity"] = {"d": np.hypot(x, y), "psi": np.arctan2(y, x)}
        if "compliance" in effects:
            flexibility = effects["compliance"].pop("flexibility")
            stiff = flexibility < 1e-6
            effects["compliance"]["K"] = np.where(stiff, 0.0, 1.0 / np.where(stiff, 1.0, flexibility))
            effects["compliance"]["C"] = np.where(stiff, self._off("compliance.C"), effects["compliance"]["C"])
        if "stribeck" in effects:  # what does nothing must not make another run of the same physics
            idle = effects["stribeck"]["a"] == 0.0
            effects["stribeck"]["w_s"] = np.where(idle, self._off("stribeck.w_s"), effects["stribeck"]["w_s"])
        offset = effects.get("angle_offset", {}).get("offset", np.zeros(len(values)))
        theta_0 = b.theta_0 - np.deg2rad(offset) / self.actuator.pole_pairs
        return make_runs(self.actuator, faults, effects=effects, theta_0=theta_0)

    def _off(self, parameter: str) -> float:
        return self.parameters[self.index[parameter]].off

    def _statistics(self, tasks: Sequence[_Task]) -> list[np.ndarray]:
        """(statistic,) statistics of every task's run as they compare with its recording's."""
        # runs go side by side, best with those that take the same way and are as long
        runs = np.array([t.run for t in tasks], RUN_DTYPE)
        lengths = np.array([len(self._brought[t.name].recording.time) for t in tasks])
        order = np.lexsort((lengths, ways(runs))).tolist()
        parts = [order[at : at + LANES] for at in range(0, len(order), LANES)]

        def work(part: list[int]) -> list[np.ndarray]:
            chosen = [tasks[n] for n in part]
            return [self._as_recorded(t.name, t.run, s) for t, s in zip(chosen, self._simulate(chosen), strict=True)]

        if self.threads > 1 and len(parts) > 1:
            with ThreadPoolExecutor(self.threads) as pool:
                done = list(pool.map(work, parts))
        else:
            done = [work(part) for part in parts]
        found = dict(zip(order, (values for part in done for values in part), strict=True))
        return [found[n] for n in range(len(tasks))]

    def _simulate(self, tasks: Sequence[_Task], samples: int | None = None) -> list[dict]:
        """Signals of every task's run, as long as its recording or of its first ``samples``."""
        brought = [self._brought[t.name] for t in tasks]
        records = [samples or len(b.recording.time) for b in brought]
        commands = [b.command if t.command is None else t.command for t, b in zip(tasks, brought, strict=True)]
        runs = np.empty(len(tasks), RUN_DTYPE)
        for n, t in enumerate(tasks):
            runs[n] = t.run
        out = simulate_each(runs, commands, [b.nominal.interval for b in brought], records)
        for signals, b, t, n in zip(out, brought, tasks, records, strict=True):
            signals["commanded_position"] = b.signals["commanded_position"][:n] + t.offset
        return out

    def simulated(self, name: str, runs: Sequence[np.void]) -> list[dict]:
        """Noise-free signals of runs (records of RUN_DTYPE) under a recording's command."""
        return self._simulate([_Task(name, run) for run in runs])

    def _as_recorded(self, name: str, run: np.void, signals: dict) -> np.ndarray:
        step = float(run["speed_quantisation_step"])
        if step > 0.0:
            sigma = self._brought[name].noise.get("speed", 0.0)
            rng = np.random.default_rng(np.frombuffer(run.tobytes(), np.uint32))
            noisy = signals["rotor_speed"] + sigma * rng.standard_normal(len(signals["rotor_speed"]))
            signals["rotor_speed"] = step * self.rounding(noisy / step)
        return self._compared(name, signals)

    def _compared(self, name: str, signals: dict) -> np.ndarray:
        """(statistic,) statistics of simulated signals as they compare with the recording's."""
        b = self._brought[name]
        return compute(b.nominal, signals).over(b.computed.norm)

    # ---- noise
    def settle(self, values: np.ndarray, part: Sequence[str]) -> None:
        """Take start angle, step instants, noise and its bias of the statistics from a comparison with one simulated
        point.

        The sensors of a bench are the same in all its recordings, so the noise of a channel is the median over those
        that have been compared.
        """
        runs = {name: self._runs(values[None, :], name)[0] for name in part}
        with ThreadPoolExecutor(self.threads) as pool:
            list(pool.map(lambda name: self._place_steps(name, runs[name]), part))
            clean = dict(zip(part, self._simulate([_Task(name, runs[name]) for name in part]), strict=True))
            list(pool.map(lambda name: self._align(name, clean[name]), part))
            for channel, value in self._noise(clean).items():
                for name in part:
                    self._brought[name].noise[channel] = value
            list(pool.map(lambda name: self._correct_bias(name, clean[name]), part))
        self._cache.clear()
        self._averages.clear()

    def _align(self, name: str, clean: dict) -> None:
        """Take the start angle, and how far the rotor goes astray, from noise-free signals."""
        b = self._brought[name]
        first = max(3, min(len(clean["rotor_angle"]) // 20, round(5e-3 / b.nominal.interval)))
        drift = float(np.median((b.signals["rotor_angle"] - clean["rotor_angle"])[:first]))
        if abs(drift) < 0.2:
            b.theta_0 += drift
        apart = uniform_filter1d(b.signals["rotor_angle"] - clean["rotor_angle"], SMOOTHED)
        least, most = START_SCATTER
        least *= max(1.0, b.nominal.interval / 2e-4)  # the fewer samples, the more each of them weighs
        b.start_scatter = float(np.clip(ASTRAY * np.std(apart), least, most))

    def _place_steps(self, name: str, run: np.void) -> None:
        """A step of the command lies somewhere in its recording interval: take the instant that fits the angle best."""
        b = self._brought[name]
        if not len(b.jumps):
            return
        until = min(len(b.recording.time), int(b.jumps[0, 1]) + max(10, round(0.015 / b.nominal.interval)))
        tick = self.actuator.control_period / float(b.nominal.interval * np.min(np.diff(b.jumps, axis=1)))
        moments = [*np.arange(EARLIEST, 1.0, max(0.5 * tick, 0.1)), 1.0, None]
        commands = [self._command(b.recording, b.jumps, moment) for moment in moments]
        tried: list[tuple[float, float | None, np.ndarray]] = []
        found = self._simulate([_Task(name, run, command) for command in commands], until)
        for moment, command, signals in zip(moments, commands, found, strict=True):
            missed = signals["rotor_angle"] - b.signals["rotor_angle"][:until]
            tried.append((float(np.sum(missed**2)), moment, command))
        least = min(error for error, _, _ in tried)
        # moments within one control tick are the same; the middle one is furthest from the next
        alike = [t for t in tried if t[0] <= least * (1.0 + 1e-9)]
        _, b.moment, b.command = alike[(len(alike) - 1) // 2]

    def _command(self, recording: Recording, jumps: np.ndarray, moment: float | None = None) -> np.ndarray:
        """Command at the control ticks: linear between recorded values, but for jumps that happen at once.

        ``moment`` is the fraction of the time between the samples beside a jump after which it happens; None leaves it
        linear.
        """
        interval = recording.interval
        duration = interval * len(recording.time)
        time = recording.time - (recording.time[0] - interval)
        position = recording.commanded_position
        time, position = with_corners(time, position)
        if moment is not None and len(jumps):
            recorded, (last, first) = recording.commanded_position, jumps.T
            begin, end = interval * (last + 1), interval * (first + 1)
            moments = begin + moment * (end - begin)
            within = np.any((time[:, None] > begin + 1e-9) & (time[:, None] < end - 1e-9), axis=1)
            time = np.concatenate([time[~within], moments - 1e-6, moments - 1e-9])
            position = np.concatenate([position[~within], recorded[last], recorded[first]])
            order = np.argsort(time, kind="stable")
            time, position = time[order], position[order]
            keep = np.concatenate([[True], np.diff(time) > 0])
            time, position = time[keep], position[keep]
        return resample(time, position, duration, self.actuator.control_period)

    def _noise(self, clean: Mapping[str, dict]) -> dict[str, float]:
        """Noise of each channel (1 sigma): spread of the recordings less what the simulated machine itself does.

        Of all recordings compared so far, for a few that confirm would tell little by themselves.
        """
        for name, signals in clean.items():
            b = self._brought[name]
            own, model = channel_spread(b.signals, b.nominal), channel_spread(signals, b.nominal)
            b.variances = {channel: spread**2 - model.get(channel, 0.0) ** 2 for channel, spread in own.items()}
        known = [name for name, b in self._brought.items() if b.variances]
        # where an actuator hunts, recording and simulation differ by more than noise
        judged = [name for name in known if not self.erratic(name)] or known
        out = {}
        for channel in CHANNELS:
            usual = getattr(self.sensor_noise, channel)
            found = [v[channel] for name in judged if channel in (v := self._brought[name].variances)]
            value = float(np.median(found)) if found else usual**2
            out[channel] = float(np.sqrt(max(value, (0.05 * usual) ** 2)))
        return out

    def _correct_bias(self, name: str, clean: dict) -> None:
        """Mean shift of the statistics by noise in their regressors."""
        b = self._brought[name]
        if not b.unit_noise:
            rng = np.random.default_rng(1)
            for _ in range(NOISE_PAIRS):
                b.unit_noise.append({c: rng.standard_normal(clean[s].shape) for c, s in CHANNELS.items()})
        still = self._compared(name, clean)
        total = np.zeros(SIZE)
        for unit in b.unit_noise:
            drawn = {s: b.noise[c] * unit[c] for c, s in CHANNELS.items()}
            for sign in (1.0, -1.0):  # what is linear in the noise cancels: the bias is not
                noisy = clean | {signal: clean[signal] + sign * noise for signal, noise in drawn.items()}
                total += self._compared(name, noisy)
        self._offset[name] = total / (2 * NOISE_PAIRS) - still
        self._offset[name][LATTICE] = 0.0

    def covariance(self, values: np.ndarray, part: Sequence[str]) -> np.ndarray:
        """Covariance from channel noise, the switching's own scatter and the noise correction's uncertainty."""
        first = all(v == (p.off if p.effect else p.mean) for v, p in zip(values, self.parameters, strict=True))
        runs = {name: self._runs(values[None, :], name)[0] for name in part}
        repeats = self._repeats(runs, FIRST_REPEATS if first else JITTER_REPEATS)

        def work(name: str) -> np.ndarray:
            b, run = self._brought[name], runs[name]
            jitter = self._jitter(name, repeats[name])
            b.jitter = np.diag(jitter)
            if b.by_channel is None:
                b.by_channel = covariance_by_channel(b.nominal, b.signals, b.computed)
            cov = noise_covariance(b.by_channel, b.noise)
            # the recording scatters once and the simulations it is compared with once more
            aligned = COMMUTATION_FLOOR**2 * (1.0 + 0.0025 * b.computed.count[COMMUTATION_AT:])
            cov += 2.0 * jitter
            extra = (BIAS_TRUST * self._offset.get(name, np.zeros(SIZE))) ** 2
            extra[COMMUTATION_AT:] += aligned
            # a speed that changes slowly is rounded the same way for many samples on end
            step = float(run["speed_quantisation_step"])
            extra[SPEED_AT:LATTICE] += ROUNDED_ALIKE * step**2 / 12.0
            cov[np.diag_indices(SIZE)] += extra + 1e-18
            return cov[np.ix_(b.usable, b.usable)]

        with ThreadPoolExecutor(self.threads) as pool:
            blocks = list(pool.map(work, part))
        size = sum(len(block) for block in blocks)
        out = np.zeros((size, size))
        at = 0
        for block in blocks:
            out[at : at + len(block), at : at + len(block)] = block
            at += len(block)
        return out

    def scatter(self, part: Sequence[str]) -> np.ndarray:
        """(statistic,) variance of a single prediction by where its switching falls."""
        none = np.zeros(SIZE)
        brought = [self._brought[name] for name in part]
        return np.concatenate([(none if b.jitter is None else b.jitter)[b.usable] for b in brought])

    def smooth(self, values: np.ndarray, part: Sequence[str]) -> np.ndarray:
        """(statistic,) prediction averaged over where its switching falls."""
        runs = {name: self._runs(values[None, :], name)[0] for name in part}
        keys = {name: (name, run.tobytes()) for name, run in runs.items()}
        missing = {name: run for name, run in runs.items() if keys[name] not in self._averages}
        for name, repeats in self._repeats(missing, JITTER_REPEATS).items():
            self._averages[keys[name]] = np.mean(repeats, axis=0)
        averages = {name: self._averages[keys[name]] + self._offset.get(name, 0.0) for name in part}
        return np.concatenate([averages[name][self._brought[name].usable] for name in part])

    def _shifts(self, name: str) -> np.ndarray:
        """(angle, comparator or command, repeat) shifts by which the same physics switches at other instants."""
        b = self._brought[name]
        ripple = RIPPLE_SCATTER if b.nominal.has_end else RIPPLE_UNKNOWN
        scale = np.array([[b.start_scatter], [ripple], [COMMAND_SCATTER]])
        return scale * np.random.default_rng([2, *name.encode()]).standard_normal((3, JITTER_REPEATS))

    def _repeats(self, runs: Mapping[str, np.void], count: int) -> dict[str, np.ndarray]:
        """(repeat, statistic) of simulations of the same physics that switch at other instants, by recording."""
        tasks = []
        for name, run in runs.items():
            b = self._brought[name]
            for turn, band, offset in self._shifts(name)[:, :count].T:
                moved = run.copy()
                moved["theta_0"] += turn
                moved["hysteresis"] *= 1.0 + band
                if not len(b.jumps):
                    tasks.append(_Task(name, moved))
                    continue
                moment = b.moment
                if moment is not None:  # it is known to a part of the interval only
                    moment = float(np.clip(moment + MOMENT_SCATTER * offset / COMMAND_SCATTER, EARLIEST, 1.0))
                tasks.append(_Task(name, moved, self._command(b.recording, b.jumps, moment) + offset, offset))
        found = self._statistics(tasks)
        return {name: np.array(found[n * count : (n + 1) * count]) for n, name in enumerate(runs)}

    def _jitter(self, name: str, repeats: np.ndarray) -> np.ndarray:
        """(statistic, statistic) covariance of a single prediction by where its switching falls."""
        b = self._brought[name]
        apart = (repeats - repeats.mean(axis=0)) / np.sqrt(len(repeats) - 1)
        variance = np.square(apart).sum(axis=0)
        for alike in ALIKE:  # the three phases scatter alike, and few repeats tell a variance poorly
            variance[alike] = 0.5 * (variance[alike] + variance[alike].mean(axis=0))
        # what scatters together counts once; as few repeats tell of it little, half is taken for independent
        out = TOGETHER * apart.T @ apart
        out[np.diag_indices(SIZE)] = variance
        return out * (1.0 + 2.0 / len(repeats)) * (HUNTING if len(b.jumps) else 1.0)

    def report(
        self, effect: str, values: Mapping[str, float], deviations: Mapping[str, float]
    ) -> dict[str, tuple[float, float, float, str]]:
        """Catalogue parameters of an effect from those it was fitted in: name -> (value, low, high, units), 90 %."""
        return report({p.name: p for p in self.parameters}, effect, values, deviations)
