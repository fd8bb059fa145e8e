"""What every reconstruction returns, and what they share: settings and the recorded signals they read."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, TypeVar

import numpy as np

from ..errors import InputError

S = TypeVar("S")


@dataclass(frozen=True)
class Features:
    """Reconstructed phase parameters of a batch of runs; what a method does not estimate is NaN."""

    R: np.ndarray  # (run, phase) ohm
    k: np.ndarray  # (run, phase) V s/rad
    L: np.ndarray  # (run, phase) H
    offset: np.ndarray  # (run, phase) V, intercept
    covariance: np.ndarray  # (run, 6, 6) of [R_a, R_b, R_c, k_a, k_b, k_c]
    extras: dict[str, np.ndarray] = field(default_factory=dict)  # what only one method gives, leading axis run

    @property
    def six(self) -> np.ndarray:
        """(run, 6) the generalised features [R_a, R_b, R_c, k_a, k_b, k_c]."""
        return np.concatenate([self.R, self.k], axis=1)

    @property
    def standard_error(self) -> np.ndarray:
        """(run, 6) standard errors of ``six``."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    @property
    def nine(self) -> np.ndarray:
        """(run, 9) R, k and L of phases a, b, c."""
        return np.concatenate([self.R, self.k, self.L], axis=1)

    @property
    def nine_error(self) -> np.ndarray:
        """(run, 9) standard errors of ``nine``, of a method that gives their covariance."""
        return np.sqrt(np.diagonal(self.extras["nine_covariance"], axis1=1, axis2=2))

    @property
    def inputs(self) -> np.ndarray:
        """(run, 6) R and k, (run, 8) xi behind them where it is measured by itself, or (run, 9) R, k and L."""
        if "nine_covariance" in self.extras:
            return self.nine
        return self.six if "xi" not in self.extras else np.concatenate([self.six, self.extras["xi"]], axis=1)

    @property
    def inputs_covariance(self) -> np.ndarray:
        """(run, 9, 9) of ``nine`` where a method gives it, else (run, 6, 6) of ``six``."""
        return self.extras.get("nine_covariance", self.covariance)

    @property
    def identified(self) -> np.ndarray:
        """(run,) whether the record held enough to estimate all six."""
        return np.all(np.isfinite(self.six), axis=1)


def join_features(parts: list[Features]) -> Features:
    """Features of several batches, one after the other along the run axis."""
    names = [f.name for f in fields(Features) if f.name != "extras"]
    joined = {name: np.concatenate([getattr(p, name) for p in parts]) for name in names}
    extras = {name: np.concatenate([p.extras[name] for p in parts]) for name in parts[0].extras}
    return Features(**joined, extras=extras)


def read_settings(cls: type[S], settings: Mapping[str, Any], method: str) -> S:
    """Settings of a method from a mapping; what is not given keeps its default.

    Raises
    ------
    InputError : an unknown key
    """
    known = [f.name for f in fields(cls)]  # type: ignore[arg-type]
    for key in settings:
        if key not in known:
            raise InputError(f"reconstruction.{key}: not a setting of '{method}', accepted are {', '.join(known)}")
    return cls(**settings)


def check_number(method: str, key: str, value: float, low: float, high: float = np.inf) -> None:
    """Refuse a setting outside low <= value <= high.

    Raises
    ------
    InputError : naming the key, its value and the range
    """
    if not (isinstance(value, int | float) and low <= value <= high):
        raise InputError(f"reconstruction.{key}: got {value!r}, '{method}' accepts {low:g} to {high:g}")


@dataclass(frozen=True)
class Signals:
    """The recorded signals that a reconstruction reads."""

    voltage: np.ndarray  # (run, time, phase) V
    current: np.ndarray  # (run, time, phase) A
    current_end: np.ndarray | None  # (run, time, phase) A
    speed: np.ndarray  # (run, time) rad/s
    angle: np.ndarray  # (run, time) rad, at the interval's end
    interval: float  # s

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.speed)


def read_signals(signals: Mapping[str, np.ndarray], interval: float) -> Signals:
    """Pick and check the signals; a single recording without run axis counts as one run.

    Raises
    ------
    InputError : a signal is missing or of the wrong shape, or the interval is not positive
    """
    if not interval > 0.0:
        raise InputError(f"interval: got {interval} s, a positive recording interval is accepted")
    found: dict[str, np.ndarray | None] = {"phase_current_end": None}
    for name, dimensions in (
        ("rotor_speed", 2),
        ("rotor_angle", 2),
        ("phase_voltage", 3),
        ("phase_current", 3),
        ("phase_current_end", 3),
    ):
        values = signals.get(name)
        if values is None:
            if name == "phase_current_end":
                continue
            raise InputError(f"{name}: missing among the signals, the reconstruction needs it")
        values = np.asarray(values, float)
        if values.ndim == dimensions - 1:
            values = values[None]
        speed = found.get("rotor_speed")
        wanted = (values.shape if speed is None else speed.shape) + ((3,) if dimensions == 3 else ())
        if values.shape != wanted:
            raise InputError(f"{name}: has shape {values.shape}, {wanted} is accepted")
        found[name] = values
    return Signals(
        voltage=found["phase_voltage"],  # type: ignore[arg-type]
        current=found["phase_current"],  # type: ignore[arg-type]
        current_end=found["phase_current_end"],
        speed=found["rotor_speed"],  # type: ignore[arg-type]
        angle=found["rotor_angle"],  # type: ignore[arg-type]
        interval=float(interval),
    )
