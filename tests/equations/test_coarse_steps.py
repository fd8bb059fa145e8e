"""Whole diagnoses of recordings whose channels come in coarse steps."""

import numpy as np
import pytest

from .conftest import COGGING, all_but, bench, in_steps, verdict_of

COARSE = {
    "currents beside an effect": ({"phase_current": 0.09, "phase_current_end": 0.09}, COGGING, "sensor_current"),
    "output beside an effect": ({"output_position": 1e-4}, COGGING, "position"),
    "encoder of 4096 counts beside an effect": ({"rotor_angle": 2.0 * np.pi / 4096.0}, COGGING, None),
}


@pytest.mark.parametrize(
    "case", [c if c.startswith("currents") else pytest.param(c, marks=pytest.mark.long) for c in COARSE]
)
def test_coarse_steps_are_told_and_nothing_for_them(case):
    steps, effects, equation = COARSE[case]
    few = all_but("cogging", "stribeck", "magnet_temperature", "self_heating", "backlash")
    exclude = few if equation == "sensor_current" else ()
    verdict = verdict_of({name: in_steps(r, steps) for name, r in bench(effects).items()}, exclude=exclude)
    assert [(d["form"], d["equation"]) for d in verdict["discovered"]] == ([("adc_step", equation)] if equation else [])
    assert verdict["which"][0]["effects"] == list(effects)
    for d in verdict["discovered"]:
        assert d["parameters"]["step"]["value"] == pytest.approx(next(iter(steps.values())))
