"""Logs of a simulated actuator as a bench would write them: channels by name, against any reference."""

from dataclasses import dataclass, field

import numpy as np

from emafault.actuator.commands import command_positions
from emafault.actuator.motor import PAIR
from emafault.actuator.parameters import ActuatorParameters, make_runs
from emafault.actuator.simulate import simulate, time_axis
from emafault.config import compose

ACTUATOR = ActuatorParameters(**compose()["actuator"])
INTERVAL = 2e-4  # s, of the recordings
FAULT = (0.06, 0.0, 0.03, 0.05, -0.02, 4.0)
NOISE = {"u": 0.05, "i": 0.005, "angle": 1e-4, "speed": 0.3, "out": 1e-5, "bus": 0.05}
UNITS = {"u": "V", "i": "A", "angle": "rad", "speed": "rad/s", "out": "rad", "cmd": "rad", "bus": "V"}
CHANNELS = ("ua", "ub", "uc", "ia", "ib", "ic", "angle", "speed", "out", "cmd", "bus")


def simulated(step, duration=0.5, motion="reversal", fault=FAULT):
    """Signals of one run without noise, as means over ``step`` and instants at its end."""
    settings = {"reversal": {"amplitude": 0.03, "speed": 0.25}, "parabolic": {"acceleration": 0.4}}[motion]
    runs = make_runs(ACTUATOR, np.array([fault]), theta_0=0.7)
    command = command_positions(motion, settings, duration, ACTUATOR.control_period)
    out = {name: values[0] for name, values in simulate(runs, command, duration, step).items()}
    return out | {"time": time_axis(duration, step)}


def averaged(s, several):
    """The same signals over intervals of several samples: means of means, and instants at the ends."""
    instants = ("rotor_angle", "output_position", "commanded_position", "phase_current_end", "time")
    n = len(s["time"]) // several * several
    mean = {k: v[:n].reshape(-1, several, *v.shape[1:]).mean(axis=1) for k, v in s.items() if k not in instants}
    return mean | {k: s[k][several - 1 : n : several] for k in instants}


def rested(s, seconds):
    """The same signals after a rest, as a bench records them."""
    step = s["time"][1] - s["time"][0]
    n = round(seconds / step)
    still = ("rotor_angle", "output_position", "commanded_position", "bus_voltage")
    out = {k: np.concatenate([np.repeat(v[:1] if k in still else 0.0 * v[:1], n, axis=0), v]) for k, v in s.items()}
    return out | {"time": step * np.arange(1, n + len(s["time"]) + 1)}


def terminals(s):
    """Terminal voltages against DC minus, and duties, empty where a leg is off; (sample, 3) each.

    The pair that is driven switches together, so that its line voltage tells its duty, and that the star point.
    """
    a = ACTUATOR
    x = a.pole_pairs * np.concatenate([s["rotor_angle"][:1], 0.5 * (s["rotor_angle"][1:] + s["rotor_angle"][:-1])])
    p, q = PAIR[((np.rad2deg(x) - 30.0) % 360.0 // 60.0).astype(int)].T
    row = np.arange(len(x))
    u, i, bus = s["phase_voltage"], s["phase_current"], s["bus_voltage"]
    line = u[row, p] - u[row, q] + a.switch_resistance * (i[row, p] - i[row, q])
    duty = 0.5 * (line / bus + 1.0)
    star = duty * bus - a.switch_resistance * i[row, p] - u[row, p]
    duties = np.full_like(u, np.nan)
    duties[row, p], duties[row, q] = duty, 1.0 - duty
    return u + star[:, None], np.clip(duties, 0.0, 1.0)


def against(s, reference):
    """(sample, 3) voltages against a reference of the import's map."""
    u = s["phase_voltage"]
    return {
        "star": lambda: u,
        "dc_minus": lambda: terminals(s)[0],
        "virtual_star": lambda: u - u.mean(axis=1, keepdims=True),
        "line_to_line": lambda: u - np.roll(u, -1, axis=1),
        "duty": lambda: terminals(s)[1],
    }[reference]()


@dataclass
class Log:
    """Channels by name with their units, and what the map says of them."""

    time: np.ndarray
    channels: dict
    units: dict = field(default_factory=dict)

    def change(self, **functions):
        """Replace channels by functions of themselves."""
        for name, function in functions.items():
            self.channels[name] = function(self.channels[name])
        return self

    def swap(self, one, other):
        """Exchange two channels."""
        self.channels[one], self.channels[other] = self.channels[other], self.channels[one]
        return self


def log(s, reference="star", noisy=True):
    """A log of all channels on one clock; the angle shows the rotor's from another zero."""
    rng = np.random.default_rng(7)
    three = {"u": against(s, reference), "i": s["phase_current"]}
    channels = {f"{kind}{'abc'[k]}": x[:, k] for kind, x in three.items() for k in range(3)}
    channels |= {"angle": s["rotor_angle"] - 0.25, "speed": s["rotor_speed"], "out": s["output_position"]}
    channels |= {"cmd": s["commanded_position"], "bus": s["bus_voltage"]}
    per_sample = np.sqrt(INTERVAL / (s["time"][1] - s["time"][0]))  # a mean's noise is that of the recordings
    for name, values in channels.items():
        sigma = NOISE.get(name.rstrip("abc") if name[0] in "ui" else name, 0.0)
        sigma = 0.0 if reference == "duty" and name[0] == "u" else sigma
        averaged = name[0] in "ui" or name in ("speed", "bus")
        channels[name] = values + noisy * sigma * (per_sample if averaged else 1.0) * rng.standard_normal(len(values))
    units = {name: UNITS[name.rstrip("abc") if name[0] in "ui" else name] for name in channels}
    if reference == "duty":
        units |= {name: "1" for name in ("ua", "ub", "uc")}
    return Log(s["time"], channels, units)


def map_of(reference="star", samples="means", **more):
    """A map of such a log, as a dictionary."""
    signals = {
        "phase_voltage": {"reference": reference, "channels": ["ua", "ub", "uc"]},
        "phase_current": {"channels": ["ia", "ib", "ic"]},
        "rotor_angle": {"channel": "angle"},
        "rotor_speed": {"channel": "speed"},
        "output_position": {"channel": "out"},
        "commanded_position": {"channel": "cmd"},
        "bus_voltage": {"channel": "bus"},
    }
    entry = {"name": "one", "file": "log.parquet", "health": "unknown", "ambient": "24 degC", "command": "reversal"}
    base = {"unit": "unit 7", "interval": INTERVAL, "loggers": {"daq": {"samples": samples}}}
    return base | {"recordings": [entry], "signals": signals} | more
