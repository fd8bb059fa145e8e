"""The point at which a bench is linearised: parameters with their priors there, and the units that act."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .linear import OWN_FORM
from .model import TOLERANCES, Parameter, Unit, Variant
from .sets import OTHER_FORM, Choice

REACH = (1.0, TOLERANCES)  # prior standard deviations from the prior's mean that the point keeps to, at first and later


def is_parameter(column: str) -> bool:
    """Whether a column is a parameter's, and not a function of a remainder or of an effect's own form."""
    return not column.startswith(("remainder.", "own."))


def _in_logarithms(step: float) -> float:
    return float(np.exp(np.clip(step, -1.0, 1.0)))


def in_values(step: float) -> float:
    """Factor of a quantity that an equation is linear in after a relative step, which keeps its sign."""
    return 1.0 + step if step > -0.5 else -0.25 / step


@dataclass(frozen=True)
class Place:
    """Where a point was, and which units acted there."""

    point: Mapping[str, float]
    on: frozenset[str]


class Point:
    """Where the parameters of some recordings of a machine are, and which units act there."""

    reaches = REACH

    def __init__(self, machine, recordings: Sequence[str]):
        self.machine, self.recordings = machine, list(recordings)
        self.parameters: dict[str, Parameter] = dict(machine.parameters)
        self.units: list[Unit] = list(machine.units)
        self.point = {n: p.off for n, p in self.parameters.items()}
        self.on: set[str] = set()
        self.sound = False  # whether the unit is taken to have none of the faults that it may not have
        self.reach = self.reaches[1]
        of_unit = {p.name for u in self.units for p in u.parameters}
        mine = set(self.recordings)
        self.nuisances = [
            n
            for n, p in self.parameters.items()
            if n not in of_unit and not p.fixed and p.sd > 0.0 and ("@" not in n or n.split("@", 1)[1] in mine)
        ]
        self._beyond: dict[str, list[str]] = {}
        for n, p in self.parameters.items():
            if p.alias is not None:
                self._beyond.setdefault(p.alias, []).append(n)

    def here(self) -> Place:
        """Where the point is."""
        return Place(dict(self.point), frozenset(self.on))

    def go_to(self, place: Place) -> None:
        """Move the point to where it was once."""
        self.point, self.on = dict(place.point), set(place.on)

    def active(self, unit: Unit) -> list[Variant]:
        """Variants of a unit at the present point."""
        if unit.on is not None and unit.id in self.on:
            return [unit.on]
        return list(unit.variants)

    def columns(self) -> tuple[list[str], dict[str, str]]:
        """Names of all columns of units at the present point, and aliases."""
        names, aliases = [], {}
        for unit in self.units:
            for v in self.active(unit):
                for p in v.parameters:
                    names.append(p.name)
                    if p.alias is not None:
                        aliases[p.name] = p.alias
        return list(dict.fromkeys(names)), aliases  # variants of a unit may share some

    def names_of(self, choice: Choice) -> list[str]:
        """Columns of a unit's variant at the present point."""
        if choice.unit.startswith("remainder:"):
            return []
        unit = next(u for u in self.units if u.id == choice.unit)
        return [p.name for p in self.active(unit)[choice.variant % OTHER_FORM].parameters]

    def _kind(self, unit: str) -> str:
        return next((u.kind for u in self.units if u.id == unit), "remainder")

    def values(self) -> dict[str, float]:
        """The point as the machine takes it: what lies beyond a tolerance added to its quantity."""
        out = dict(self.point)
        for n, p in self.parameters.items():
            if p.alias is not None:
                out[p.alias] = out.get(p.alias, self.parameters[p.alias].off) + self.point.get(n, 0.0)
        return out

    def prior(self, name: str) -> tuple[float, float, float]:
        """Deviation of the prior's mean from the point, its standard deviation, and the deviation that is off."""
        if not is_parameter(name):
            return 0.0, OWN_FORM if name.startswith("own.") else 1.0, 0.0
        p = self.parameters[name]
        at = self.point.get(name, p.off)
        centre, sd = (p.off, p.absent) if self.sound and p.absent > 0.0 else (p.mean, p.sd)
        if p.vanishes is None:
            return centre - at, sd, p.off - at
        u, factor = self._factor(name)
        if p.alias is not None:  # beyond its tolerance: a factor on its quantity's own
            own = u / factor
            return -u * np.log(factor), sd * u / own, -u * np.log(factor)
        mean, off = centre - p.vanishes, p.off - p.vanishes
        return u * np.log(mean / factor), sd * abs(u / mean), u * np.log(off / factor)

    def _factor(self, name: str) -> tuple[float, float]:
        """What a parameter that multiplies makes with its alias, the unit of its deviations, and its own factor."""
        p = self.parameters[name]
        assert p.vanishes is not None
        own = p.alias or name
        base = self.point.get(own, self.parameters[own].off) - p.vanishes
        beyond = sum(self.point.get(n, 0.0) for n in self._beyond.get(own, ()))
        if p.alias is None:
            return base + beyond, base
        return base + beyond, (base + beyond) / base

    def after(self, given: Mapping[str, float], share_of=_in_logarithms) -> dict[str, float]:
        """Values of parameters after deviations from the point; ``share_of`` : factor that a deviation makes of one."""
        out: dict[str, float] = {}
        for n, d in given.items():
            if not is_parameter(n):
                continue
            p = self.parameters[n]
            if p.vanishes is None:
                out[n] = self.point.get(n, p.off) + d
            elif p.alias is None:
                u, factor = self._factor(n)
                out[n] = p.vanishes + factor * share_of(d / u)
            else:
                u, factor = self._factor(n)
                own = out.get(p.alias, p.vanishes + u / factor)
                out[n] = (own - p.vanishes) * (factor * share_of(d / u) - 1.0)
        return out

    def _deviation_to(self, name: str, value: float) -> float:
        """Deviation of a parameter of its own, not one beyond a tolerance, at which it has a value."""
        p = self.parameters[name]
        if p.vanishes is None:
            return value - self.point.get(name, p.off)
        u, factor = self._factor(name)
        share = (value - p.vanishes) / factor
        return u * float(np.log(share)) if share > 0.0 else -np.inf * np.sign(u)

    def _reach_of(self, name: str) -> tuple[float, float]:
        """Least and largest deviation where the prior has any mass: a model that lacks the cause asks for more."""
        mean, sd, _ = self.prior(name)
        low, high = mean - self.reach * sd, mean + self.reach * sd
        p = self.parameters[name]
        if p.vanishes is not None and p.alias is None:  # a tolerance may be one of the value, or of its logarithm
            least = self._deviation_to(name, p.mean - self.reach * p.sd)
            low = min(low, least) if np.isfinite(least) else low
        return low, high

    def _switch_on(self, unit: Unit, p: Parameter, amount: float) -> None:
        """An effect found along a secant gets parameters of its own."""
        assert unit.on is not None and p.secant is not None
        amount = float(np.clip(amount, 0.2, 5.0))
        first = True
        for own in unit.on.parameters:
            at = p.secant.get(own.name, own.mean)
            self.point[own.name] = own.off + (at - own.off) * amount if first else at
            first = False
