"""Channels slower than the recording: only their new samples count, and they are told."""

from dataclasses import replace

import numpy as np
import pytest

from emafault.equations.quality import seen, told
from emafault.equations.signals import Signals, estimated_noise

from .conftest import ACTUATOR, EVERY, NOISE, held, lines, machine_of, recorded


def slower(recording, how, *variables):
    return replace(recording, **{v: how(getattr(recording, v)) for v in variables})


@pytest.mark.parametrize("how", [held, lines])
def test_noise_and_residuals_are_those_of_the_new_samples(how):
    plain = [recorded(c, seed=n) for n, c in enumerate(("sine", "reversal"))]
    slow = [slower(r, how, "rotor_speed", "output_position") for r in plain]
    found, own = estimated_noise(slow, NOISE), estimated_noise(plain, NOISE)
    assert found.speed == pytest.approx(own.speed, rel=0.15) and found.position == pytest.approx(own.position, rel=0.15)
    machine = machine_of({"slow": slow[0], "quick": plain[0]})
    off = {n: p.off for n, p in machine.parameters.items()}
    of = {name: {b.equation: b for b in machine.blocks(off, name)} for name in ("slow", "quick")}
    for equation in ("sensor_speed", "position"):
        block, whole = of["slow"][equation], of["quick"][equation]
        rows = np.flatnonzero(block.usable)
        assert np.mean(rows % EVERY == 0) > 0.99 and len(rows) > 0.15 * len(whole.residual)
        assert block.residual[rows] == pytest.approx(whole.residual[rows], abs=1e-9)
    for equation in ("electrical_a", "torque", "sensor_current"):
        assert of["slow"][equation].residual == pytest.approx(of["quick"][equation].residual, abs=1e-12)


def test_a_further_draw_of_the_noise_is_held_alike():
    signals = Signals.of("a.nc", slower(recorded("sine"), held, "rotor_speed"), ACTUATOR, NOISE)
    more = signals.disturbed(0).speed_recorded - signals.speed_recorded
    new = np.flatnonzero(signals.new["speed"])
    assert np.std(more[new]) == pytest.approx(NOISE.speed, rel=0.1)
    assert more == pytest.approx(np.interp(np.arange(len(more)), new, more[new]))
    assert signals.spacing("speed") == pytest.approx(EVERY, rel=0.02) and signals.spacing("output") == 1.0


def test_it_is_told_with_its_term_and_nothing_else_of_the_channel():
    recording = slower(recorded("sine"), held, "rotor_speed")
    (entry,) = told({"a.nc": seen(recording)})
    assert entry["equation"] == "sensor_speed" and entry["form"] == "held"
    assert entry["term"] == {"place": "speed", "form": "hold", "every": EVERY}
    assert "one sample in 5 is new" in entry["sentence"]


def test_the_term_makes_such_a_channel():
    made = recorded("sine", unlisted=[{"place": "speed", "form": "hold", "every": EVERY}])
    assert made.rotor_speed == pytest.approx(held(recorded("sine").rotor_speed))
