"""A measured machine as the diagnosis takes one: its rows linearised, its effects as units, remainders along its rows.

Errors that several rows share are nuisances of their recording with a prior of one: marginalised in closed form they
are the rows' covariance, and the rows themselves stay independent, so that what their coordinates say stays true.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..diagnosis.model import Block, Parameter, Unit, Variant
from . import statement
from .statement import Effect, Machine, Rows

STEP = 1e-3  # prior standard deviations, of a difference that stands for a derivative
SMOOTH = 14  # functions of a remainder that is smooth along the coordinates
DEGREE = 3  # of its polynomials
WAVES = 24  # functions of one that changes faster along one coordinate: half waves over its range, orders of a turn
FEW = 6  # kinds of rows that may differ by a constant each
COVERED = 0.6  # of what is possible of an instrument, the widest of its priors
AMOUNT = 2.0  # prior width of an effect along a secant, in parts of its usual size
ALONG = ("rotor_speed", "current", "rotor_angle", "time", "direction", "temperature")


class Recorded:
    """Recordings of a measured machine.

    Parameters
    ----------
    recordings : those that are open; nothing of another is looked at
    begun : the same machine with fewer recordings, whose functions of remainders are kept
    """

    def __init__(self, machine: Machine, recordings: Sequence[str], begun: "Recorded | None" = None):
        self.machine = machine
        self.rows: dict[str, list[Rows]] = {name: [] for name in recordings}
        for rows in machine.rows:
            if rows.recording in self.rows:
                self.rows[rows.recording].append(rows)
        self.names = {p.name: p.name if p.effect is None else f"{p.effect}.{p.name}" for p in machine.parameters}
        self.short = {full: name for name, full in self.names.items()}
        self.parameters = {self.names[p.name]: _core(self.names[p.name], p) for p in machine.parameters}
        # nobody states a tolerance of these instruments: the widest prior covers all that is possible of one
        self.reach = {
            e.id: min(_reach(p) for p in machine.parameters if p.effect == e.id)
            for e in machine.effects
            if e.equations[0].startswith("sensor_") and not e.shapes
        }
        self.bounds = {self.names[p.name]: (p.low, p.high) for p in machine.parameters}
        for every in self.rows.values():
            for rows in every:
                for k in range(0 if rows.shared is None else rows.shared.shape[1]):
                    full = _error(rows, k)
                    self.parameters[full] = Parameter(full, 0.0, 0.0, 1.0, "1")
        library = {e.id for e in machine.effects}
        for p in machine.parameters:  # of an effect left out of the library
            if p.effect is not None and p.effect not in library:
                full = self.names[p.name]
                self.parameters[full] = replace(self.parameters[full], sd=0.0, fixed=True)
        self.units = [self._unit(e) for e in machine.effects]
        for unit in self.units:
            for own in unit.parameters:
                self.parameters.setdefault(own.name, own)
        self.places: dict[str, dict[tuple, int]] = {e: dict(p) for e, p in begun.places.items()} if begun else {}
        self.ranges: dict[str, dict[str, tuple[float, float]]] = dict(begun.ranges) if begun else {}
        self.kinds: dict[str, list[str]] = dict(begun.kinds) if begun else {}
        for equation in dict.fromkeys(r.equation for every in self.rows.values() for r in every):
            self._lay_out(equation)
        self._kept: dict[str, tuple[Any, list[Block]]] = {}

    # ---- effects
    def _unit(self, effect: Effect) -> Unit:
        mine = [p for p in self.machine.parameters if p.effect == effect.id]
        own = [self.parameters[self.names[p.name]] for p in mine]
        signs = [_side(p) for p in mine]
        if not effect.shapes:
            return Unit(effect.id, "structural", effect.equations, [Variant(own, signs)])
        variants = []
        for n, shape in enumerate(effect.shapes):
            full = f"{effect.id}#{n}"
            secant = {self.names[name]: value for name, value in shape.items()}
            one = Parameter(full, 0.0, 0.0, AMOUNT, "1", secant=secant)
            variants.append(Variant([one], [_side(mine[0]) * int(np.sign(next(iter(shape.values())) - mine[0].off))]))
        return Unit(effect.id, "structural", effect.equations, variants, Variant(own, signs))

    # ---- equations
    def prepare(self, name: str, values: Mapping[str, float]) -> None:
        """Nothing depends on the point alone."""

    def blocks(
        self, values: Mapping[str, float], name: str, disturbed: bool = False, wanted: Collection[str] | None = None
    ) -> list[Block]:
        """Predicted less observed rows of every equation of a recording, with columns by each parameter ``wanted``.

        What the equations read is taken as exact: a second draw of the noise changes nothing.
        """
        key = dict(values), None if wanted is None else frozenset(wanted)
        kept = self._kept.get(name)
        if kept is None or kept[0] != key:
            kept = self._kept[name] = key, [self.block(r, values, wanted) for r in self.rows[name]]
        return kept[1]

    def predict(self, rows: Rows, points: Sequence[Mapping[str, float]]) -> np.ndarray:
        """(point, row) what the equation says, without errors that rows share."""
        named = {
            short: np.array([[p.get(full, self.parameters[full].off)] for p in points])
            for short, full in self.names.items()
        }
        found = self.machine.equations[rows.equation](named, rows.inputs)
        return np.broadcast_to(found, (len(points), rows.size))

    def block(self, rows: Rows, values: Mapping[str, float], wanted: Collection[str] | None) -> Block:
        """Rows linearised at a point, with columns by each parameter ``wanted``."""
        asked = [n for n in self.parameters if wanted is None or n in wanted]
        points: list[Mapping[str, float]] = [values]
        for n in asked:
            p = self.parameters[n]
            if n in self.short and p.sd > 0.0:
                points += [{**values, n: values[n] + s * STEP * p.sd} for s in (1.0, -1.0)]
            elif p.secant is not None and all(values[k] == self.parameters[k].off for k in p.secant):
                points.append({**values, **p.secant})
        found = iter(self.predict(rows, points))
        here = next(found)
        columns: dict[str, np.ndarray] = {}
        for n in asked:
            p = self.parameters[n]
            if n in self.short and p.sd > 0.0:
                columns[n] = (next(found) - next(found)) / (2.0 * STEP * p.sd)
            elif p.secant is not None and all(values[k] == self.parameters[k].off for k in p.secant):
                columns[n] = next(found) - here
        residual = here - rows.observed
        if rows.shared is not None:
            names = [_error(rows, k) for k in range(rows.shared.shape[1])]
            residual = residual + rows.shared @ np.array([values.get(n, 0.0) for n in names])
            columns |= {n: rows.shared[:, k] for k, n in enumerate(names) if n in asked}
        columns = {n: c for n, c in columns.items() if np.any(c)}
        usable = np.ones(rows.size, bool)
        return Block(rows.recording, rows.equation, residual, columns, [rows.variance], usable, self.coordinates(rows))

    # ---- coordinates and functions of remainders
    def _lay_out(self, equation: str) -> None:
        """Ranges of the coordinates, kinds of rows and places of an equation, those known already kept."""
        every = [r for rows in self.rows.values() for r in rows if r.equation == equation]
        if equation not in self.ranges:
            along = {n: np.concatenate([_along(r)[n] for r in every]) for n in _along(every[0])}
            self.ranges[equation] = {n: (float(x.min()), float(x.max())) for n, x in along.items() if np.ptp(x) > 0.0}
            self.kinds[equation] = sorted({label for r in every for label in r.labels})
        places = self.places.setdefault(equation, {})
        for key in sorted({k for r in every for k in _places(r)} - set(places)):
            places[key] = len(places)

    def families(self, equation: str) -> tuple:
        """A remainder goes along all coordinates together: few rows tell them apart."""
        return ()

    own_families = families

    def functions(self, rows: Rows) -> np.ndarray:
        """(function, row): a constant, smooth and faster functions of the coordinates, one for each place."""
        found = [np.ones(rows.size)]
        kinds = self.kinds[rows.equation]
        if 1 < len(kinds) <= FEW:
            found += [np.array([label == kind for label in rows.labels], float) for kind in kinds[1:]]
        along = _along(rows)
        for degree in range(1, DEGREE + 1):
            for name, (low, high) in self.ranges[rows.equation].items():
                if name == "rotor_angle":
                    found += [np.cos(degree * along[name]), np.sin(degree * along[name])]
                else:
                    z = 2.0 * (along[name] - low) / (high - low) - 1.0
                    found.append(np.polynomial.legendre.Legendre.basis(degree)(np.clip(z, -1.0, 1.0)))
        found = found[:SMOOTH]
        found += [np.zeros(rows.size)] * (SMOOTH - len(found))
        for name, (low, high) in self.ranges[rows.equation].items():
            if name == "rotor_angle":
                turns = np.outer(DEGREE + 1 + np.arange(WAVES // 2), along[name])
                found += [*np.cos(turns), *np.sin(turns)]
            else:
                z = np.clip((along[name] - low) / (high - low), 0.0, 1.0)
                found += [*np.cos(np.pi * np.outer(DEGREE + 1 + np.arange(WAVES), z))]
        places = self.places[rows.equation]
        table = np.zeros((len(places), rows.size))
        table[[places[k] for k in _places(rows)], np.arange(rows.size)] = 1.0
        return np.vstack([found, table])

    def coordinates(self, rows: Rows) -> dict[str, Any]:
        """What the rows lie along, with the functions of a remainder."""
        along = {n: np.zeros(rows.size) for n in ALONG} | _along(rows)
        if "order" in along:  # told where it has been found: see ``told_along``
            along["rotor_angle"] = along["order"]
        phi = self.functions(rows)
        return {**along, "phi": phi, "own": phi[:SMOOTH], "drivers": np.ones((1, rows.size)), "slow": ()}

    def told_along(self, along: str) -> str:
        """A coordinate's name in the verdict."""
        orders = any(r.along == "order" for every in self.rows.values() for r in every)
        return "order" if along == "rotor_angle" and orders else along


def _core(full: str, p: statement.Parameter) -> Parameter:
    """A parameter; one of the base model that is never negative multiplies, and deviates in its logarithm."""
    vanishes = 0.0 if p.effect is None and p.low >= 0.0 and p.mean > 0.0 else None
    return Parameter(full, p.off, p.mean, p.sd, p.units, vanishes=vanishes)


def _reach(p: statement.Parameter) -> float:
    """Width of a prior that covers all that is possible of a parameter, over its usual one; 1 where nothing says it."""
    reach = max(abs(p.high - p.off), abs(p.low - p.off))
    return max(1.0, COVERED * reach / p.sd) if np.isfinite(reach) and p.mean == p.off else 1.0


def _error(rows: Rows, k: int) -> str:
    return f"error.{rows.equation}.{k}@{rows.recording}"


def _side(p: statement.Parameter) -> int:
    """+1 or -1 where a parameter's range lies on one side of off, and its prior is not already all there."""
    if p.mean != p.off:
        return 0
    return int(p.low >= p.off) - int(p.high <= p.off)


def _along(rows: Rows) -> dict[str, np.ndarray]:
    """Coordinates (row,) by name, the rows' own first."""
    return {rows.along: 0.5 * (rows.low + rows.high), **{n: np.asarray(x, float) for n, x in rows.beside.items()}}


def _places(rows: Rows) -> list[tuple]:
    """Where each row looks: the same in every recording that looks there."""
    return [(rows.label(k), float(f"{rows.low[k]:.6g}"), float(f"{rows.high[k]:.6g}")) for k in range(rows.size)]
