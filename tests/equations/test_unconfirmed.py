"""What the explored recordings show and those set aside cannot is said, though not told."""

import pytest

from emafault.equations.diagnose import diagnose

from .conftest import ACTUATOR, NOISE, recorded

WEAK = {"place": "emf_a", "form": "bump", "depth": -0.07, "centre": 3.9, "width": 0.3}
FAR = {"parabolic": {"acceleration": 0.35}, "reversal": {"amplitude": 0.05, "speed": 0.3}}
NEAR = {"amplitude": 0.002, "frequency": 4.0}  # from 0.7 rad, a rad either way


@pytest.mark.parametrize("passes", [False, True])
def test_a_form_that_the_recording_set_aside_does_not_pass_is_warned_of(passes):
    recordings = {f"{c}.nc": recorded(c, settings=s, seed=n, unlisted=(WEAK,)) for n, (c, s) in enumerate(FAR.items())}
    motion = {"amplitude": 0.03, "frequency": 1.5} if passes else NEAR
    recordings["sine.nc"] = recorded("sine", settings=motion, seed=5, unlisted=(WEAK,))
    split = ["parabolic.nc", "reversal.nc"], ["sine.nc"]
    verdict = diagnose("bench", recordings, split, ACTUATOR, NOISE).verdict
    described = [d["form"] for d in verdict["discovered"]]
    warned = [w["message"] for w in verdict["warnings"]]
    if passes:
        assert described == ["bump"] and not warned
    else:
        assert not described and len(warned) == 1
        assert warned[0].startswith("not told, for the recordings set aside to confirm it hardly pass where it shows: ")
        assert "3.9 rad" in warned[0]
