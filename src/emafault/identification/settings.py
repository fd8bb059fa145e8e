"""Settings of a network and of its training, made from plain mappings and checked key by key."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from itertools import pairwise
from typing import Any, Self

from ..errors import InputError
from .levenberg_marquardt import ACTIVATIONS

COORDINATES = ("linear", "log")
OPTIMISERS = ("levenberg_marquardt", "adam")


class _Settings:
    """A frozen dataclass that can be made from a mapping; unknown keys and wrong values are refused by name."""

    section = ""

    @classmethod
    def of(cls, values: "Mapping[str, Any] | Self | None") -> Self:
        """Settings from a mapping; what is missing keeps its default.

        Raises
        ------
        InputError : an unknown key or an impossible value, naming what is accepted
        """
        if isinstance(values, cls):
            return values
        accepted = {f.name: f for f in fields(cls)}  # type: ignore[arg-type]
        given: dict[str, Any] = dict(values or {})  # type: ignore[arg-type]
        for key, value in given.items():
            if key not in accepted:
                raise InputError(f"{cls.section}.{key}: not known, accepted are {', '.join(accepted)}")
            given[key] = _converted(f"{cls.section}.{key}", value, accepted[key].type)
        return cls(**given)

    def as_dict(self) -> dict[str, Any]:
        """Plain mapping, as :meth:`of` takes it."""
        return asdict(self)  # type: ignore[call-overload]

    def _require(self, key: str, accepted: bool, what: str) -> None:
        if not accepted:
            raise InputError(f"{self.section}.{key}: got {getattr(self, key)!r}, accepted {what}")


def _converted(name: str, value: Any, kind: Any) -> Any:
    kinds = {int: "a whole number", float: "a number", str: "a word"}
    good = {
        int: isinstance(value, int) and not isinstance(value, bool),
        float: isinstance(value, (int, float)) and not isinstance(value, bool),
        str: isinstance(value, str),
    }[kind]
    if not good:
        raise InputError(f"{name}: got {value!r}, accepted is {kinds[kind]}")
    return kind(value)


@dataclass(frozen=True)
class NetworkSettings(_Settings):
    """Shape of a network; the defaults are the paper's 6-12-6 with tanh on standardised features.

    ``coordinates`` are those of R and k before they are standardised: ``log`` turns the products of the fault laws
    into sums, which a small network meets with fewer units.
    """

    section = "network"
    layers: int = 1  # hidden layers
    width: int = 12  # units in each
    activation: str = "tanh"
    coordinates: str = "linear"

    def __post_init__(self) -> None:
        self._require("layers", self.layers in (1, 2, 3), "are 1, 2 and 3 hidden layers")
        self._require("width", 1 <= self.width <= 256, "are 1 to 256 units")
        self._require("activation", self.activation in ACTIVATIONS, f"are {', '.join(ACTIVATIONS)}")
        self._require("coordinates", self.coordinates in COORDINATES, f"are {', '.join(COORDINATES)}")

    def sizes(self, inputs: int = 6, outputs: int = 6) -> tuple[int, ...]:
        """Layer sizes, inputs first."""
        return (inputs, *[self.width] * self.layers, outputs)

    def parameters(self, inputs: int = 6, outputs: int = 6) -> int:
        """Number of weights and biases."""
        sizes = self.sizes(inputs, outputs)
        return sum((i + 1) * o for i, o in pairwise(sizes))


@dataclass(frozen=True)
class TrainingSettings(_Settings):
    """How a network is trained; the defaults are the paper's.

    ``reweight`` counts further passes in which the residuals are whitened by their own covariance, the
    maximum-likelihood fit of outputs whose errors differ in size and are correlated (as those of N_j and dT are).
    """

    section = "training"
    optimiser: str = "levenberg_marquardt"
    train_fraction: float = 0.70
    validation_fraction: float = 0.15  # the rest are test rows
    epochs: int = 300
    max_fail: int = 10  # failed validation checks
    weight_decay: float = 0.0
    reweight: int = 0
    learning_rate: float = 0.01  # adam only
    batch: int = 64  # adam only

    def __post_init__(self) -> None:
        self._require("optimiser", self.optimiser in OPTIMISERS, f"are {', '.join(OPTIMISERS)}")
        self._require("train_fraction", 0.0 < self.train_fraction < 1.0, "is a fraction between 0 and 1")
        rest = 1.0 - self.train_fraction
        self._require(
            "validation_fraction",
            0.0 < self.validation_fraction <= rest + 1e-9,
            "is above 0, at most 1 - train_fraction",
        )
        for key in ("epochs", "max_fail", "batch"):
            self._require(key, getattr(self, key) >= 1, "is 1 or more")
        self._require("weight_decay", self.weight_decay >= 0.0, "is 0 or more")
        self._require("reweight", 0 <= self.reweight <= 5, "are 0 to 5 passes")
        self._require("learning_rate", self.learning_rate > 0.0, "is above 0")
