"""What a network is retrained on has what was described."""

import numpy as np
import pytest

from emafault.config import compose, retraining_spec
from emafault.faults import FAULT_NAMES
from emafault.io.recording import Recording
from emafault.study.retrain import simulated_features


def test_features_that_are_learnt_from_have_what_was_described():
    spec = retraining_spec(compose(overrides=["sampling.runs=20"]))
    time = 2e-4 * np.arange(1, 2501)
    still = {name: np.zeros(2500) for name in ("rotor_speed", "rotor_angle", "output_position")}
    signals = {name: np.zeros((2500, 3)) for name in ("phase_voltage", "phase_current", "phase_current_end")}
    bench = {"a.nc": Recording(time, commanded_position=0.15 * time**2, ambient_temperature=20.0, **still, **signals)}
    settings = dict(spec["reconstruction"])
    method, jump = settings.pop("method"), {"form": "step_change", "jump": 0.2, "time": 0.0}
    found = {}
    for place in ("", "resistance_b", "emf_c"):
        unlisted = [jump | {"place": place}] if place else []
        what = {"effects": {}, "unlisted": unlisted}
        features, faults = simulated_features(bench, what, spec, method, settings, "simulate")
        found[place] = features.six
        assert faults.shape == (20, len(FAULT_NAMES))
    added, factor = found["resistance_b"] - found[""], found["emf_c"] / found[""]
    assert np.median(added[:, 1]) == pytest.approx(0.2, abs=0.01) and np.abs(np.median(added[:, [0, 2]])) < 0.01
    assert np.median(factor[:, 5]) == pytest.approx(1.2, rel=2e-3)
