"""An actuator as the numbers of a joint: MJCF for MuJoCo, URDF for ROS.

Reflected to the output shaft a ratio n makes inertia n^2 J, damping n^2 B, dry friction n T_c and torque 2 n k i.
"""

from collections.abc import Callable
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

from ..actuator.parameters import ActuatorParameters


def mjcf(name: str, a: ActuatorParameters) -> str:
    """A default class for a hinge and its motor, whose control is the current (A); angles in rad."""
    root = Element("mujoco")
    root.append(Comment(f" {_said(name)}: {_left_out(a)} "))
    SubElement(root, "compiler", angle="radian")
    of = SubElement(SubElement(root, "default"), "default", {"class": _identifier(name)})
    SubElement(
        of, "joint", type="hinge", armature=_text(a.inertia * a.gear_ratio**2),
        damping=_text(a.viscous_friction * a.gear_ratio**2), frictionloss=_text(a.coulomb_friction * a.gear_ratio),
        limited="true", range=f"{_text(-a.end_stop)} {_text(a.end_stop)}",
    )  # fmt: skip
    limit = _text(a.current_limit)
    SubElement(of, "motor", gear=_text(_per_ampere(a)), ctrllimited="true", ctrlrange=f"-{limit} {limit}")
    return _written(root)


def urdf(name: str, a: ActuatorParameters) -> str:
    """A revolute joint with its limits and dynamics, and its transmission; links are to be named."""
    word = _identifier(name)
    root = Element("robot", name=word)
    root.append(
        Comment(f" {_said(name)}: {_left_out(a)}; reflected inertia {_text(a.inertia * a.gear_ratio**2)} kg m2 ")
    )
    for link in ("base", "output"):
        SubElement(root, "link", name=link)
    joint = SubElement(root, "joint", name=word, type="revolute")
    SubElement(joint, "parent", link="base")
    SubElement(joint, "child", link="output")
    SubElement(joint, "axis", xyz="0 0 1")
    SubElement(
        joint, "limit", lower=_text(-a.end_stop), upper=_text(a.end_stop),
        effort=_text(_per_ampere(a) * a.current_limit), velocity=_text(a.speed_limit / a.gear_ratio),
    )  # fmt: skip
    dynamics = {
        "damping": _text(a.viscous_friction * a.gear_ratio**2),
        "friction": _text(a.coulomb_friction * a.gear_ratio),
    }
    SubElement(joint, "dynamics", dynamics)
    transmission = SubElement(root, "transmission", name=f"{word}_transmission")
    SubElement(transmission, "type").text = "transmission_interface/SimpleTransmission"
    SubElement(SubElement(transmission, "joint", name=word), "hardwareInterface").text = "EffortJointInterface"
    motor = SubElement(transmission, "actuator", name=f"{word}_motor")
    SubElement(motor, "mechanicalReduction").text = _text(a.gear_ratio)
    return _written(root)


FORMATS: dict[str, Callable[[str, ActuatorParameters], str]] = {"mjcf": mjcf, "urdf": urdf}


def _per_ampere(a: ActuatorParameters) -> float:
    """Torque at the output shaft for a current in two phases (N m/A)."""
    return 2.0 * a.back_emf * a.gear_ratio


def _left_out(a: ActuatorParameters) -> str:
    return (
        f"without backlash ({_text(a.backlash)} rad), static friction ({_text(a.static_over_coulomb)} times the dry "
        f"one), {_text(a.resistance)} ohm and {_text(a.inductance)} H a phase"
    )


def _text(value: float) -> str:
    return f"{value:.6g}"


def _said(name: str) -> str:
    return name.replace("--", "- ")  # which a comment may not hold


def _identifier(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name).strip("_") or "actuator"


def _written(root: Element) -> str:
    indent(root)
    return tostring(root, encoding="unicode") + "\n"
