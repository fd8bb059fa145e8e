"""Hydra configuration: schemas, composition, the sub-tree each stage reads, digests of the sources it runs."""

from pathlib import Path

from omegaconf import OmegaConf

CONF = Path(__file__).resolve().parents[2] / "conf"


def reference_actuator():
    """The nominal actuator of conf/actuator/reference.yaml."""
    from .actuator.parameters import ActuatorParameters

    return ActuatorParameters(**OmegaConf.to_container(OmegaConf.load(CONF / "actuator" / "reference.yaml")))  # type: ignore[arg-type]
