"""The file of one's own actuator: read in any units, composed, refused where its numbers contradict each other."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from emafault import config
from emafault.cli import main
from emafault.datasheet.compose import of_file
from emafault.datasheet.keys import KEYS
from emafault.datasheet.sheet import SCHEMA, read_sheet, split
from emafault.effects import EFFECTS
from emafault.effects.scaling import scaled
from emafault.errors import InputError
from emafault.units import quantity

EXAMPLES = Path(__file__).parents[2] / "examples" / "actuators"
HINGE = yaml.safe_load((EXAMPLES / "hinge_28v.yaml").read_text())


def written(folder, **changes):
    """The example's file with changes, None taking a key out."""
    content = {k: v for k, v in (HINGE | changes).items() if v is not None}
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("120 gcm2", "kg m^2", 1.2e-5),
        ("1.2e-5 kg m2", "kg m^2", 1.2e-5),
        ("28 mNm/A", "N m/A", 0.028),
        ("341 rpm/V", "rad/s/V", 341 * np.pi / 30),
        ("341 min-1/V", "rad/s/V", 341 * np.pi / 30),
        ("2.93 V/krpm", "V s/rad", 2.93e-3 * 30 / np.pi),
        ("2.93 V/1000rpm", "V s/rad", 2.93e-3 * 30 / np.pi),
        ("1.4 arcmin", "rad", 1.4 / 60 * np.pi / 180),
        ("0.5 Ω", "ohm", 0.5),
    ],
)
def test_units_as_datasheets_write_them(text, unit, value):
    number, spelt = split(text)
    assert quantity(f"{number!r} {spelt}", unit, "x") == pytest.approx(value, rel=1e-9)


def test_the_reference_actuator_s_datasheet_is_the_reference_actuator():
    machine = of_file(EXAMPLES / "reference_48v.yaml")
    for name, value in vars(config.reference_actuator()).items():
        assert getattr(machine.actuator, name) == pytest.approx(value, rel=1e-12), name
    assert not machine.notes
    for effect, own in machine.tolerances().items():
        for name, tolerance in own.items():
            assert tolerance >= EFFECTS[effect].parameters[name].tolerance


def test_what_is_not_said_is_assumed_and_said_so():
    machine = of_file(EXAMPLES / "hinge_28v.yaml")
    gain, ratio = machine.parameters["speed_gain"], machine.parameters["gear_ratio"]
    assert (gain.source, ratio.source) == ("assumed", "datasheet")
    a = machine.actuator
    assert gain.value * 2.0 * a.back_emf / a.inertia == pytest.approx(752.0)
    at_no_load = a.coulomb_friction + a.viscous_friction * 9300 * np.pi / 30
    assert at_no_load == pytest.approx(2.0 * a.back_emf * 0.97)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"speed_constant": "197 rpm/V"}, ("torque_constant (28.0 mNm/A) and speed_constant", "1.73", "sine waves")),
        ({"speed_constant": "682 rpm/V"}, ("factor of 2", "a phase's, not line to line")),
        ({"resistance": "600 ohm"}, ("time constant",)),
        ({"resistance": "0.6 V"}, ("resistance", "ohm")),
        ({"resistance": "0.6"}, ("resistance", "line to line")),
        ({"resistance": "?"}, ("resistance", "unknown")),
        ({"resistance": "0.6 ohm +- 5 apples"}, ("resistance", "tolerance")),
        ({"resistance": {"value": "0.6 ohm", "source": "hearsay"}}, ("resistance", "hearsay")),
        ({"gear_ratio": None}, ("gear_ratio", "missing")),
        ({"torque_constant": None, "speed_constant": "?"}, ("torque_constant", "one of them")),
        ({"pole_pairs": 3.5}, ("pole_pairs", "whole number")),
        ({"supply_voltage": "28 kV"}, ("supply_voltage", "no machine has")),
        ({"gear": 120}, ("gear", "gear_ratio")),
        ({"backlash": [1, 2]}, ("backlash",)),
    ],
)
def test_a_file_is_refused_in_one_line(tmp_path, capsys, changes, says):
    path = written(tmp_path, **changes)
    assert main(["actuator", "show", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and str(path) in said
    for word in says:
        assert word in said


def test_smaller_contradictions_are_named_and_not_refused(tmp_path):
    notes = of_file(written(tmp_path, rated_torque="200 mNm", no_load_speed="7000 rpm")).notes
    assert len(notes) == 2 and "rated_torque" in notes[1] and "no_load_speed" in notes[0]


def test_nothing_where_a_quantity_may_be_none(tmp_path):
    path = written(tmp_path, backlash="0 rad", coulomb_friction="0 N m", viscous_friction="0 N m s/rad")
    machine = of_file(path)
    assert machine.actuator.coulomb_friction == 0.0 and machine.actuator.backlash == 1e-6
    assert any("no_load_current" in note for note in machine.notes)
    assert all(np.isfinite(p.high) for e in scaled(machine.actuator).values() for p in e.parameters.values())


def test_the_schema_lists_the_keys():
    assert set(json.loads(SCHEMA.read_text())["properties"]) == {"name", *KEYS}
    for path in EXAMPLES.glob("*.yaml"):
        assert read_sheet(path).numbers


def test_a_configuration_takes_the_file_and_single_values_after_it(tmp_path):
    path = written(tmp_path)
    composed = config.compose("paper", [f"actuator={path}", "actuator.gear_ratio=130"])
    assert composed["actuator"]["gear_ratio"] == 130 and composed["actuator"]["pole_pairs"] == 7
    assert composed["tolerances"]["unit_calibration"]["R_scale"] == pytest.approx(0.1 / 1.645)
    with pytest.raises(InputError, match="no such file"):
        config.compose("paper", "actuator=nowhere.yaml")
    assert config.compose("paper")["tolerances"] == {}


def test_effects_scale_with_the_actuator():
    reference, hinge = config.reference_actuator(), of_file(EXAMPLES / "hinge_28v.yaml").actuator
    assert scaled(reference) == EFFECTS
    own = scaled(hinge, {"friction_level": {"scale": 0.3}})
    friction = hinge.coulomb_friction / reference.coulomb_friction
    assert own["cogging"].parameters["a"].high == pytest.approx(0.01 * friction)
    assert own["load_constant"].parameters["T"].high == pytest.approx(10.0 * friction * 120 / 500)
    assert own["contact_resistance"].parameters["R_x_a"].high == pytest.approx(0.05 * 0.3 / 1.065)
    assert own["current_offset"].parameters["o_a"].high == pytest.approx(0.05 * 15 / 20)
    assert own["bus_voltage"].parameters["Vdc"].nominal == 28.0
    assert own["hall_displacement"] == EFFECTS["hall_displacement"]
    assert own["friction_level"].parameters["scale"].high == pytest.approx(2.0**3)
    with pytest.raises(InputError, match=r"effects\.cogging\.a"):
        config.compose("paper", [f"actuator={EXAMPLES / 'hinge_28v.yaml'}", "effects.cogging.a=0.05"])
