"""Joint numbers of other simulators, against the reflected ones."""

from xml.etree.ElementTree import fromstring

import pytest

from emafault.cli import main
from emafault.config import reference_actuator

from .test_sheet import EXAMPLES

A = reference_actuator()


def exported(capsys, to):
    assert main(["actuator", "export", str(EXAMPLES / "reference_48v.yaml"), "--to", to]) == 0
    return fromstring(capsys.readouterr().out)


def test_mjcf(capsys):
    root = exported(capsys, "mjcf")
    joint, motor = root.find(".//joint"), root.find(".//motor")
    assert float(joint.get("armature")) == pytest.approx(A.inertia * 500**2)
    assert float(joint.get("damping")) == pytest.approx(A.viscous_friction * 500**2)
    assert float(joint.get("frictionloss")) == pytest.approx(A.coulomb_friction * 500)
    assert [float(x) for x in joint.get("range").split()] == [-0.5, 0.5]
    assert float(motor.get("gear")) == pytest.approx(2 * 0.0376 * 500) and motor.get("ctrlrange") == "-20 20"


def test_urdf(capsys, tmp_path):
    joint = exported(capsys, "urdf").find("joint")
    limit = joint.find("limit")
    assert float(limit.get("effort")) == pytest.approx(2 * 0.0376 * 500 * 20)
    assert float(limit.get("velocity")) == pytest.approx(1.0)
    assert float(joint.find("dynamics").get("friction")) == pytest.approx(30.0)
    out = tmp_path / "out.urdf"
    line = ["actuator", "export", str(EXAMPLES / "reference_48v.yaml"), "--to", "urdf", "--out", str(out)]
    assert main(line) == 0 and fromstring(out.read_text()).tag == "robot"
    assert main(line) == 2 and main([*line, "--force"]) == 0
