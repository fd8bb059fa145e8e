"""Whole diagnoses by equation errors: what is named, beside what, and what must change nothing."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
import yaml

from emafault.equations import machine
from emafault.equations.diagnose import diagnose
from emafault.equations.handover import experiment_text
from emafault.errors import InputError

from .conftest import ACTUATOR, COGGING, NOISE, PLANS, all_but, bench, recorded, verdict_of


def test_nominal_bench_has_no_gap():
    verdict = verdict_of(bench())
    assert verdict["verdict"] == "no_gap"
    assert verdict["which"][0]["effects"] == []
    assert sum(e["probability"] for e in verdict["which"]) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(("turns", "sound"), [(0.0, True), (0.05, False)])
def test_a_unit_that_may_have_no_fault_is_taken_to_have_none_where_that_is_sure(turns, sound):
    """Turns that all phases miss alike, a unit's k makes up for: nothing else tells that there are none."""
    recordings = {
        f"r{n}.nc": recorded(c, None, (turns, 0.0, 0.0, 0.0, 0.0, dT), seed=n, theta_0=theta_0, health="unknown")
        for n, (c, dT, theta_0) in enumerate(PLANS)
    }
    names = list(recordings)
    found = diagnose("bench", recordings, (names[:3], names[3:]), ACTUATOR, NOISE)
    after = found.verdict["fault_vector"]["r0.nc"]["after"]
    assert found.bench.sound is sound
    assert after["Na"]["low"] < turns < after["Na"]["high"]
    assert (after["Nb"]["high"] - after["Nb"]["low"] < 2e-3) is sound


def test_an_effect_is_named_with_its_size(cogging):
    first = cogging["which"][0]
    assert (cogging["verdict"], first["effects"]) == ("explained", ["cogging"])
    a = first["parameters"]["a"]
    assert a["low"] < 0.004 < a["high"]
    assert cogging["where"][0]["equation"] == "torque"
    assert cogging["shrinks"]["signal"]["closed"] > 0.9


def test_displaced_sensors_that_the_library_lacks_are_no_unit_s_tolerance_but_unknown():
    """Where a phase is switched on may be off by little in any unit; far beyond that it had been taken for no gap."""
    recordings = bench({"hall_displacement": {"d_a": 0.4, "d_b": -0.5}})
    verdict = verdict_of(recordings, exclude=all_but("cogging", "control_delay", "angle_offset", "back_emf_shape"))
    assert verdict["verdict"] == "unknown" and verdict["where"][0]["equation"] == "control"
    first = max(verdict["which"], key=lambda w: w["probability"])
    assert (first["effects"], first["equation"]) == (["unknown"], "control") and first["probability"] > 0.9
    assert verdict["shrinks"]["signal"]["closed"] > 0.7
    (told,) = (d["sentence"] for d in verdict["discovered"])
    assert told == "The control equation leaves more than noise at the commutations, not described further."


def test_what_a_unit_is_beyond_its_tolerance_and_the_library_does_not_list_is_told_and_simulated():
    """Its inertia is in the equations all the same: within its tolerance alone it had been called no gap."""
    recordings = bench({"inertia": {"scale": 1.25}})
    names = list(recordings)
    exclude = all_but("cogging", "friction_level", "load_constant")
    found = diagnose("bench", recordings, (names[:3], names[3:]), ACTUATOR, NOISE, exclude)
    verdict = found.verdict
    assert verdict["verdict"] == "described" and verdict["which"][0]["effects"] == []
    (told,) = verdict["discovered"]
    assert (told["equation"], told["form"], told["term"]) == ("torque", "coefficient", None)
    assert told["parameters"]["scale"]["low"] < 1.25 < told["parameters"]["scale"]["high"]
    assert "inertia, relative to nominal: 1.25 where 1 +- 0.03 is expected" in told["sentence"]
    assert told["closed"] == verdict["shrinks"]["signal"]["closed"] > 0.9
    text = experiment_text(verdict, verdict["simulator"]["after"], "again")
    assert "not simulated" not in text
    assert yaml.safe_load(text)["effects"]["inertia"]["scale"] == pytest.approx(1.25, abs=0.02)


@pytest.mark.long
def test_a_shape_of_the_back_emf_that_the_library_lacks_is_told_by_its_harmonics_and_simulated():
    """Phase by phase, and along the angle alone, it had been waves of one phase, a gain that drifts and remainders."""
    recordings = bench({"back_emf_shape": {"width": 118.0, "h5": 0.01}})
    names = list(recordings)
    exclude = all_but("cogging", "virtual_neutral", "voltage_gain", "unit_calibration")
    verdict = diagnose("bench", recordings, (names[:3], names[3:]), ACTUATOR, NOISE, exclude).verdict
    assert verdict["verdict"] == "described" and verdict["which"][0]["effects"] == []
    told = next(d for d in verdict["discovered"] if d["unit"] == "~harmonics_emf")
    assert (told["equation"], told["form"], told["along"]) == ("electrical", "coefficient", "rotor_angle")
    assert verdict["shrinks"]["signal"]["closed"] > 0.95
    x = np.linspace(0.0, 0.5 * np.pi, 2001)
    added = np.minimum(1.0, x / np.deg2rad(31.0)) - np.minimum(1.0, x / np.deg2rad(30.0)) + 0.01 * np.sin(5.0 * x)
    for name in ("h3", "h5", "h7", "h9"):
        wanted = 2.0 * np.mean(added * np.sin(int(name[1:]) * x))
        assert told["term"][name] == pytest.approx(wanted, abs=0.3 * abs(wanted) + 1e-3), name


LITTLE = {"h3": 0.004, "h9": -0.004, "h11": 0.003, "h13": 0.003}
#: what takes a trapezoid with ramps of 30 degrees to its fundamental
SINE = {f"h{n}": -24.0 / np.pi**2 * np.sin(n * np.pi / 6.0) / n**2 for n in (3, 5, 7, 9, 11, 13)}


@pytest.mark.long
@pytest.mark.parametrize(("width", "harmonics"), [(119.5, LITTLE), (120.0, SINE)], ids=["little", "sine"])
def test_a_shape_of_the_back_emf_in_another_form_is_named(width, harmonics):
    """Of a size that the library's form hardly has, or hardly can have, it had been another cause, left unknown."""
    effect, form = {"back_emf_shape": {"width": width}}, {"place": "emf", "form": "harmonics", **harmonics}
    recordings = {
        f"r{n}.nc": recorded(c, effect, (*[0.0] * 5, dT), n, theta_0=at, unlisted=(form,))
        for n, (c, dT, at) in enumerate(PLANS)
    }
    names = list(recordings)
    exclude = all_but("back_emf_shape", "cogging", "virtual_neutral", "voltage_gain", "unit_calibration")
    verdict = diagnose("bench", recordings, (names[:3], names[3:]), ACTUATOR, NOISE, exclude).verdict
    assert (verdict["verdict"], verdict["which"][0]["effects"]) == ("explained", ["back_emf_shape"])
    assert verdict["shrinks"]["signal"]["closed"] > 0.95


def test_what_the_fit_can_only_have_far_beyond_its_prior_is_no_absence_of_a_gap(monkeypatch):
    """The linear model has a nuisance at seven tolerances, the fit at four; no remainder speaks against it."""
    monkeypatch.setattr(machine, "beyond_tolerance", lambda *_: [])
    verdict = verdict_of(bench({"inertia": {"scale": 1.25}}), exclude=all_but("cogging", "friction_level"))
    assert verdict["verdict"] == "unknown" and verdict["shrinks"]["signal"]["after"] > 1.05
    assert any("torque equation leaves more than noise" in d["sentence"] for d in verdict["discovered"])


def test_a_filter_that_the_controller_sees_and_the_library_lacks_is_no_delay_of_the_controller():
    recordings = bench({"speed_latency": {"tau": 3e-4}})
    verdict = verdict_of(recordings, exclude=all_but("cogging", "control_delay", "speed_scale", "angle_offset"))
    assert verdict["simulator"]["after"]["speed_latency"]["tau"] == pytest.approx(3e-4, rel=0.05)
    assert "not simulated" not in experiment_text(verdict, verdict["simulator"]["after"], "again")
    assert verdict["verdict"] == "described" and verdict["which"][0]["effects"] == []
    (told,) = verdict["discovered"]
    ends = told["parameters"]["lag.speed_sensor_filtered"]
    assert ends["low"] < 1.5 < ends["high"] and ends["units"] == "interval"
    assert told["sentence"].endswith("1.5 intervals, and the controller sees it so.")


def test_the_seal_can_be_recomputed(cogging):
    sealed = dict(cogging["sealed"])
    digest = sealed.pop("digest")
    text = json.dumps(sealed, sort_keys=True, separators=(",", ":"))
    assert hashlib.sha256(text.encode()).hexdigest() == digest


def test_a_position_gain_changes_no_plant_effect(cogging):
    other = replace(ACTUATOR, position_gain=130.0, speed_gain=0.2)
    verdict = verdict_of(bench(COGGING, other))
    assert verdict["which"][0]["effects"] == ["cogging"]
    for effect, p in verdict["inclusion"].items():
        if effect != "control_delay":
            assert p == pytest.approx(cogging["inclusion"][effect], abs=0.05), effect
    gain = verdict["controller"]["position_gain"]
    assert gain["low"] < 130.0 < gain["high"] and gain["nominal"] == 100.0


@pytest.mark.parametrize(
    ("form", "parameter", "size"),
    [
        ("command_filter", "filter", {"time_constant": 0.004}),
        pytest.param("feedforward", "feedforward", {"gain": 0.5}, marks=pytest.mark.long),
    ],
)
def test_what_a_controller_does_with_its_command_is_told_and_no_gap_of_the_machine(form, parameter, size):
    """Without forms of their own a filter had been told as a delay, and both as another position gain."""
    entries = [{"place": "command", "form": form, **size}]
    recordings = {
        f"r{n}.nc": recorded(c, None, (0.0,) * 5 + (dT,), seed=n, theta_0=theta_0, unlisted=entries)
        for n, (c, dT, theta_0) in enumerate(PLANS)
    }
    verdict = verdict_of(recordings)
    assert verdict["verdict"] == "no_gap" and verdict["inclusion"]["control_delay"] < 0.5
    (told,) = verdict["discovered"]
    assert (told["form"], told["equation"]) == ("controller", "control")
    assert told["parameters"][f"command.{parameter}"]["value"] == pytest.approx(*size.values(), rel=0.05)
    gain = verdict["controller"]["position_gain"]
    assert gain["low"] < 100.0 < gain["high"]


def beside_cogging(entries):
    """Two recordings of a unit with cogging and something unlisted, diagnosed with few other effects to choose."""
    recordings = {
        f"r{n}.nc": recorded(c, COGGING, (0.0,) * 5 + (dT,), seed=n, theta_0=theta_0, unlisted=entries)
        for n, (c, dT, theta_0) in enumerate(PLANS[:2])
    }
    others = all_but("cogging", "inertia", "friction_level", "viscous_friction", "stribeck", "load_constant")
    return diagnose("bench", recordings, (list(recordings), ()), ACTUATOR, NOISE, others).verdict


@pytest.mark.long
def test_all_waves_of_a_bearing_are_described():
    """A scan proposes one of them; while a set is full of what scans propose, another scan may find the next."""
    waves = [(3.57, 0.004), (7.14, 0.003), (10.71, 0.002)]
    entries = [
        {"place": "torque", "form": "order", "order": order, "amplitude": size, "phase": order} for order, size in waves
    ]
    verdict = beside_cogging(entries)
    assert verdict["which"][0]["effects"] == ["cogging"]
    assert {d["form"] for d in verdict["discovered"]} == {"order"}
    told = sorted(
        (d["parameters"]["order"]["value"], d["parameters"]["amplitude"]["value"]) for d in verdict["discovered"]
    )
    assert [order for order, _ in told] == pytest.approx([order for order, _ in waves], rel=1e-3)
    assert [size for _, size in told] == pytest.approx([size for _, size in waves], rel=0.1)


def test_a_load_that_comes_and_goes_is_one_pulse():
    verdict = beside_cogging([{"place": "torque", "form": "pulse", "jump": 0.03, "time": 0.2, "until": 0.45}])
    assert verdict["which"][0]["effects"] == ["cogging"]
    (told,) = verdict["discovered"]
    assert (told["form"], told["equation"], told["along"]) == ("step_change", "torque", "time")
    assert told["parameters"]["time"]["value"] == pytest.approx(0.2, abs=2e-4)
    assert told["parameters"]["until"]["value"] == pytest.approx(0.45, abs=2e-4)
    assert told["parameters"]["jump"]["value"] == pytest.approx(0.03, rel=0.05)
    assert "from 0.2 s to 0.45 s" in told["sentence"]


def test_names_and_order_of_files_change_nothing(cogging):
    recordings = bench(COGGING)
    renamed = {f"x{9 - n}.nc": r for n, r in enumerate(recordings.values())}
    names = list(renamed)
    explore, confirm = names[:3], names[3:]
    found = diagnose("bench", dict(reversed(list(renamed.items()))), (explore[::-1], confirm), ACTUATOR, NOISE)
    verdict = found.verdict
    assert verdict["which"][0]["effects"] == ["cogging"]
    assert verdict["inclusion"] == pytest.approx(cogging["inclusion"], abs=1e-3)


def test_an_effect_that_does_not_exist_is_refused():
    with pytest.raises(InputError, match="nothing_such"):
        verdict_of(bench(), exclude=("nothing_such",))
