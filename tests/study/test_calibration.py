"""The check of stated probabilities on an actuator: what judged cases say of them, and what is written."""

import json
from dataclasses import asdict

import numpy as np
import pytest

import emafault
from datasheet.test_sheet import EXAMPLES
from emafault import config
from emafault.actuator.parameters import ActuatorParameters
from emafault.actuator.sensors import SensorNoise
from emafault.datasheet.compose import of_file
from emafault.equations.probabilities import basis, checked_on
from emafault.errors import InputError
from emafault.study import calibration
from emafault.study.blind import run_cases
from emafault.study.calibration import begin, finish, summary
from emafault.withheld.population import population_of
from emafault.withheld.scoring import score
from emafault.withheld.verdicts import judge
from withheld.test_scoring import key_of, verdict_of


def effect_free(n, stated, right):
    """Key and verdict of a case without an effect whose first hypothesis has this probability."""
    key = key_of({}, "T0")
    key["case"]["seed"] = n
    sets = [((), stated), (("cogging",), 1.0 - stated)]
    if right:
        return key, verdict_of("no_gap", sets)
    return key, verdict_of("explained", [(("cogging",), stated), ((), 1.0 - stated)])


def judged(stated, right):
    """Rows of cases with these probabilities, right or not; what is not right is a false name."""
    return [judge(*effect_free(n, float(p), bool(x))) for n, (p, x) in enumerate(zip(stated, right, strict=True))]


def test_probabilities_that_hold_are_told_from_those_that_do_not():
    rng = np.random.default_rng(3)
    stated = rng.uniform(0.5, 1.0, 80)
    held = summary(judged(stated, rng.random(80) < stated))
    too_sure = summary(judged(np.full(80, 0.98), rng.random(80) < 0.7))
    assert held["holds"] and not too_sure["holds"]
    error = held["calibration_error"]
    assert error["low"] <= error["value"] <= error["high"] and error["median_if_held"] < error["most_if_held"]
    assert too_sure["calibration_error"]["value"] == pytest.approx(0.28, abs=0.12)


def test_false_names_are_counted_on_effect_free_cases():
    found = summary(judged([0.9] * 10, [True] * 8 + [False] * 2))
    assert found["false_names"] == {"named": 2, "cases": 10} and found["cases"] == found["counted"] == 10
    assert found["reliability"] == [{"confidence": pytest.approx(0.9), "accuracy": 0.8, "count": 10}]


@pytest.fixture
def written(tmp_path):
    """The check of an actuator of one's own, from ten cases, as the workflow writes it."""
    composed = config.compose(overrides=f"actuator={EXAMPLES / 'hinge_28v.yaml'}")
    spec = config.calibration_spec(composed, f"actuator={EXAMPLES / 'hinge_28v.yaml'}")
    files = {}
    for n in range(10):
        key, verdict = effect_free(n, 0.9, n > 0)
        files |= {f"keys/{n}.json": json.dumps(key), f"diagnoses/{n}/diagnosis.json": json.dumps(verdict)}
    (tmp_path / "T0_0.json").write_text(json.dumps({"files": files}))
    (tmp_path / "pace.json").write_text(json.dumps({"seconds": {"T0": 8.0}}))
    page, output = tmp_path / "calibration.html", tmp_path / "calibration.json"
    finish([tmp_path / "T0_0.json"], tmp_path / "pace.json", page, output, spec)
    assert "stated 0.90, 0.90 of 10" in page.read_text()
    return output, ActuatorParameters(**composed["actuator"])


def test_a_diagnosis_cites_the_check_of_its_own_actuator(written):
    path, actuator = written
    told = checked_on(actuator, path)
    assert told["same"] and told["hold"] and told["actuator"] == "hinge actuator, 28 V"
    assert told["cases"] == 10 and told["false_names"] == {"named": 1, "cases": 10}
    assert "10 blind cases of hinge actuator, 28 V: they hold" in basis(told)
    assert "1 of 10 effect-free cases got a name" in basis(told)


def test_without_a_check_of_its_own_it_cites_the_reference_actuators(written):
    _, actuator = written
    assert "not on this one; snakemake calibration" in basis(checked_on(actuator))
    reference = ActuatorParameters(**config.compose()["actuator"])
    assert basis(checked_on(reference)).endswith("blind cases of this actuator, the reference actuator.")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"format": "7"}, "format: got '7', accepted is '1.0'"),
        ({"actuator": {}}, "not a file that snakemake calibration wrote"),
        ({"counted": None}, "not a file that snakemake calibration wrote"),
    ],
)
def test_a_file_that_is_no_check_is_refused(written, change, says):
    path, actuator = written
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=says):
        checked_on(actuator, path)


def test_the_check_of_another_actuator_is_refused(written):
    path, actuator = written
    other = ActuatorParameters(**asdict(actuator) | {"resistance": 2.0 * actuator.resistance})
    with pytest.raises(InputError, match=r"another actuator, resistance 0\.3; accepted is about 0\.6"):
        checked_on(other, path)
    identified = ActuatorParameters(**asdict(actuator) | {"resistance": 1.04 * actuator.resistance})
    assert checked_on(identified, path)["same"]


SEEDS = {"T0": 40001, "T1": 40011}


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """Judged cases of the three example actuators, of 28, 48 and 270 V, by name of the file."""
    out = {}
    for path in sorted(EXAMPLES.glob("*.yaml")):
        machine, folder = of_file(path), tmp_path_factory.mktemp(path.stem)
        population = population_of(machine.actuator, machine.tolerances())
        noise = SensorNoise(**config.compose()["sensors"])
        # without an effect the reference itself is diagnosed in many other tests
        for rung in ("T1",) if path.stem.endswith("_48v") else ("T0", "T1"):
            run_cases(rung, (SEEDS[rung],), folder, machine.actuator, noise, population=population)
        out[path.stem] = score(folder)["rows"]
    return out


@pytest.mark.long
def test_what_was_checked_on_the_reference_actuator_holds_on_three(three):
    assert [name.rpartition("_")[2] for name in three] == ["28v", "48v", "270v"]
    every = [row for rows in three.values() for row in rows]
    assert all(r["right"] for r in every)
    found = summary(every)
    assert found["holds"] and found["false_names"] == {"named": 0, "cases": 2}


def test_how_long_it_takes_is_said_before_the_cases(tmp_path, monkeypatch, capsys):
    made = []
    monkeypatch.setattr(calibration, "run_cases", lambda rung, seeds, *a, population: made.append((rung, seeds)))
    composed = config.compose()
    spec = config.calibration_spec(composed) | {"cases": {"T0": 12, "T1": 31, "T2": 0}}
    out = begin(tmp_path / "pace.json", spec, "0123456789")
    assert made == [("T0", [40000]), ("T1", [40000])]
    assert out["whole"] == pytest.approx(12 * out["seconds"]["T0"] + 31 * out["seconds"]["T1"])
    assert "calibration of reference actuator, 48 V: 12 of T0 at" in capsys.readouterr().err
    assert json.loads((tmp_path / "pace.json").read_text()) == out


def test_probabilities_of_a_measured_machine_have_no_check(written):
    path, _ = written
    with pytest.raises(InputError, match="only probabilities of an actuator are checked"):
        emafault.diagnose("axis.npz", twin="friction_axis", calibration=path)
