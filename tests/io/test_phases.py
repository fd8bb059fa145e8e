"""Which phases belong together is read at speed, too, where the inductance takes more voltage than the resistance."""

from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from emafault.actuator.commands import command_positions
from emafault.actuator.parameters import make_runs
from emafault.actuator.sensors import SensorNoise, measure
from emafault.actuator.simulate import simulate, time_axis
from emafault.config import compose
from emafault.datasheet.compose import of_file
from emafault.errors import InputError
from emafault.io.recording import Recording
from emafault.io.sensors import refuse_mistaken

EXAMPLES = Path(__file__).parents[2] / "examples" / "actuators"
FILES = ("hinge_28v", "reference_48v", "rudder_270v")
CURRENTS = ("phase_current", "phase_current_end")
DURATION, INTERVAL = 0.3, 1e-4  # s
COLD = -70.0  # K above the reference temperature
#: variables whose phases are put in another order, and the one that is to be named
CHANNELS = {
    "phase_current": CURRENTS,
    "phase_voltage": ("phase_voltage",),
    "rotor_angle": ("phase_voltage", *CURRENTS),
}


@pytest.fixture(scope="module", params=FILES)
def fast(request):
    """A cold unit with more inductance than nominal, as fast as its controller lets it go, one way and the other."""
    actuator = of_file(EXAMPLES / f"{request.param}.yaml").actuator
    noise = SensorNoise(**compose()["sensors"])
    reach = 0.3 * DURATION * actuator.speed_limit / actuator.gear_ratio
    out = []
    for n, (amplitude, theta_0) in enumerate(((reach, 0.3), (-reach, 4.0))):
        unit = {"inductance_tolerance": {"L_scale": 1.1}}
        runs = make_runs(actuator, np.array([[0.0] * 5 + [COLD]]), effects=unit, theta_0=theta_0)
        position = command_positions("step", {"amplitude": amplitude, "time": 0.02}, DURATION, actuator.control_period)
        signals = measure(simulate(runs, position, DURATION, INTERVAL), runs, noise, 5, n)
        ambient = float(signals.pop("ambient_temperature")[0])
        shown = {name: values[0] for name, values in signals.items()}
        out.append(Recording(time=time_axis(DURATION, INTERVAL), ambient_temperature=ambient, **shown))
    return actuator, out


def without_ends(recording):
    return replace(recording, phase_current_end=None)


@pytest.mark.parametrize("lose", [lambda r: r, without_ends], ids=["ends", "means alone"])
def test_phases_in_order_are_taken_at_full_speed(fast, lose):
    actuator, recordings = fast
    for recording in recordings:
        refuse_mistaken("r.nc", lose(recording), actuator)


@pytest.mark.parametrize("lose", [lambda r: r, without_ends], ids=["ends", "means alone"])
@pytest.mark.parametrize("named", CHANNELS)
def test_every_other_order_is_refused_at_full_speed(fast, named, lose):
    actuator, recordings = fast
    for order in list(permutations(range(3)))[1:]:
        for recording in recordings:
            given = lose(recording)
            changed = {n: x[:, order] for n in CHANNELS[named] if (x := getattr(given, n)) is not None}
            with pytest.raises(InputError, match=f"^r.nc: {named} (has its phases swapped|does not go with)"):
                refuse_mistaken("r.nc", replace(given, **changed), actuator)
