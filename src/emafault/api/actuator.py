"""The nominal actuator that recordings are compared with."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from .. import config
from ..actuator.parameters import ActuatorParameters
from ..actuator.sensors import SensorNoise
from ..datasheet.override import override_of
from .table import Table


@dataclass(frozen=True)
class Actuator:
    """The nominal actuator and what its sensors' noise is where recordings do not tell it."""

    parameters: ActuatorParameters
    sensors: SensorNoise
    spec: Mapping[str, Any] = field(repr=False, compare=False)  # as composed, for diagnosing and planning

    @classmethod
    def reference(cls, *overrides: str, **numbers: float) -> "Actuator":
        """The reference actuator, or one that differs from it.

        Parameters
        ----------
        overrides : Hydra overrides as those of the command line, as ``"sensors.voltage=0.1"``
        numbers : values of the actuator (SI), as ``gear_ratio=400``; ``conf/actuator/reference.yaml`` lists them

        Raises
        ------
        InputError : a number that there is not, or a value that is impossible
        """
        return cls._composed([*overrides, *(f"actuator.{name}={value}" for name, value in numbers.items())])

    @classmethod
    def of_file(cls, path: str | Path, *overrides: str) -> "Actuator":
        """One's own actuator, by the numbers of its datasheet (``docs/actuators.md``); overrides as of ``reference``.

        Raises
        ------
        InputError : a file or an override that cannot be used
        """
        return cls._composed([override_of(str(path)), *overrides])

    @classmethod
    def _composed(cls, texts: list[str]) -> "Actuator":
        config.refuse_unread(texts, ("actuator", "sensors"), "Actuator")
        spec = config.diagnosis_spec(config.compose(overrides=texts))
        return cls(ActuatorParameters(**spec["actuator"]), SensorNoise(**spec["sensors"]), spec)

    def table(self) -> Table:
        """A row a number of the actuator, in SI units."""
        rows = [[f.name, getattr(self.parameters, f.name)] for f in fields(self.parameters)]
        return Table(["parameter", "value"], rows)

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()
