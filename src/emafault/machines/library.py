"""Measured machines by name, or as a file that states one, and the cases that recordings hold."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import util
from pathlib import Path
from types import ModuleType

import numpy as np

from ..errors import InputError, shown
from ..places import kind
from . import back_emf, dq_machine, friction_axis, induction_currents, propeller_sweep, six_step_bus, slow_rotation
from .statement import COORDINATES, EQUATIONS, Arrays, Distortion, Machine, told

_MODULES: dict[str, ModuleType] = {
    "dq_machine": dq_machine,
    "six_step_bus": six_step_bus,
    "propeller_sweep": propeller_sweep,
    "back_emf": back_emf,
    "slow_rotation": slow_rotation,
    "friction_axis": friction_axis,
    "induction_currents": induction_currents,
}
MEASURED = tuple(_MODULES)
MAPPABLE = tuple(name for name, module in _MODULES.items() if hasattr(module, "UNITS"))
ENDINGS = (".csv.gz", ".npz")
NEEDED = ("read", "build")
ACCEPTED = "accepted is a Python file with read(path) -> {case: arrays} and build(case, arrays) -> Machine"


@dataclass(frozen=True)
class Stated:
    """A kind of machine: how its recordings are read, and what it states of each."""

    name: str
    read: Callable[[Path], Mapping[str, Arrays]]
    build: Callable[[str, Arrays], Machine]
    distortions: Sequence[Distortion] = ()
    units: Mapping[str, str] = field(default_factory=dict)  # of the columns that an import map may fill
    optional: Sequence[str] = ()  # of these
    ending: str = ENDINGS[0]  # of the file of them that it reads


def stated(name: str, what: str = "--twin") -> Stated:
    """The machine of this name, or of this Python file.

    Parameters
    ----------
    what : key or option that gives the name

    Raises
    ------
    InputError
        when there is none, or the file states none.
    """
    if name in MEASURED:
        return _of(name, _MODULES[name])
    if not name.endswith(".py"):
        raise InputError(
            f"{what}: got '{shown(name)}', accepted are {', '.join(MEASURED)} and a Python file that states a machine"
        )
    if kind(name) != "file":
        raise InputError(f"{shown(name)}: no such file; {ACCEPTED}")
    path = Path(name)
    spec = util.spec_from_file_location(f"emafault_machine_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = util.module_from_spec(spec)
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, True  # nothing is left beside a user's file
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as problem:  # whatever a user's file does wrong
        raise InputError(f"{path}: {type(problem).__name__}: {' '.join(str(problem).split())}; {ACCEPTED}") from None
    finally:
        sys.dont_write_bytecode = before
    for needed in NEEDED:
        if not callable(getattr(module, needed, None)):
            raise InputError(f"{path}: has no function '{needed}'; {ACCEPTED}")
    return _of(path.stem, module)


def _of(name: str, module: ModuleType) -> Stated:
    distortions = getattr(module, "distortions", None)
    units, optional = getattr(module, "UNITS", {}), tuple(getattr(module, "OPTIONAL", ()))
    ending = getattr(module, "ENDING", ENDINGS[0])
    if not isinstance(units, Mapping) or not all(isinstance(u, str) for u in units.values()):
        raise InputError(f"{name}: UNITS is {shown(repr(units))}, accepted is column -> unit")
    if not set(optional) <= set(units):
        raise InputError(f"{name}: OPTIONAL names {', '.join(set(optional) - set(units))}, accepted are keys of UNITS")
    if ending not in ENDINGS:
        raise InputError(f"{name}: ENDING is {shown(repr(ending))}, accepted are {', '.join(ENDINGS)}")
    return Stated(
        name, module.read, module.build, tuple(distortions()) if distortions else (), units, optional, ending
    )  # fmt: skip


def read_cases(machine: Stated, path: Path) -> dict[str, Arrays]:
    """Raw arrays of each case (machine or condition) of a file, or of the files of a folder that the machine reads.

    Raises
    ------
    InputError
        when the file is not what the machine needs, or no file of the folder is.
    """
    path, found = Path(path), kind(path)
    if found == "file":
        return _read(machine, path)
    if found != "folder":
        raise InputError(f"{shown(path)}: no such file or folder")
    cases: dict[str, Arrays] = {}
    refused = ""
    for file in sorted(path.iterdir()):
        if not file.is_file() or (machine.name in MEASURED and not file.name.endswith((".npz", ".csv", ".csv.gz"))):
            continue
        try:
            inside = _read(machine, file)
        except InputError as problem:
            refused = refused or str(problem)
            continue
        cases |= {case if case not in cases else f"{file.name}: {case}": arrays for case, arrays in inside.items()}
    if not cases:
        raise InputError(f"{path}: no file that twin {machine.name!r} reads" + (f" ({refused})" if refused else ""))
    return cases


def _read(machine: Stated, path: Path) -> dict[str, Arrays]:
    cases = _guarded(machine, "read", path)
    if not isinstance(cases, Mapping) or not all(isinstance(case, str) for case in cases):
        raise InputError(f"{machine.name}: read gives {shown(repr(cases))}, accepted is case -> arrays")
    return dict(cases)


def build(machine: Stated, case: str, arrays: Arrays) -> Machine:
    """The machine of one case, checked.

    Raises
    ------
    InputError
        when the arrays hold too little, or what is stated does not fit together.
    """
    found = _guarded(machine, "build", case, arrays)
    if not isinstance(found, Machine):
        raise InputError(f"{machine.name}: build gives a {type(found).__name__}, accepted is a Machine")
    problem = flaw(found)
    if problem:
        raise InputError(f"{machine.name}: {problem}")
    return found


def flaw(machine: Machine) -> str:
    """What does not fit together in a machine's statement; empty where all does."""
    recordings = {r.recording for r in machine.rows}
    for name in (*machine.explore, *machine.confirm):
        if name not in recordings:
            return f"recording '{name}' has no rows; those that have are {', '.join(sorted(recordings))}"
    if not machine.explore:
        return "no recording explores"
    names = [p.name for p in machine.parameters]
    twice = [n for n in names if names.count(n) > 1]
    if twice:
        return f"parameter '{twice[0]}' is stated twice"
    for effect in machine.effects:
        mine = [p.name for p in machine.parameters if p.effect == effect.id]
        if not mine:
            return f"effect '{effect.id}' has no parameter"
        for shape in effect.shapes:
            if not set(shape) <= set(mine):
                return (
                    f"effect '{effect.id}': a shape names {', '.join(sorted(set(shape) - set(mine)))}, which it has not"
                )
    beside: dict[tuple[str, str], set[str]] = {}
    for rows in machine.rows:
        if rows.equation not in machine.equations:
            return f"rows of '{rows.equation}', accepted are the equations {', '.join(machine.equations)}"
        if told(rows.equation) not in EQUATIONS:
            return f"equation '{rows.equation}', accepted are {', '.join(EQUATIONS)} and parts of one, as torque_front"
        if rows.along not in COORDINATES:
            return f"rows of {rows.equation} lie along '{rows.along}', accepted are {', '.join(COORDINATES)}"
        sizes = {len(rows.observed), len(rows.variance), len(rows.low), len(rows.high)}
        if len(sizes) > 1:
            return f"rows of {rows.equation} in '{rows.recording}': observed, variance, low and high differ in length"
        if not np.isfinite(rows.observed).all():
            return f"rows of {rows.equation} in '{rows.recording}': a measured value is not a finite number"
        if set(rows.beside) != beside.setdefault((rows.equation, rows.along), set(rows.beside)):
            return f"rows of {rows.equation} in '{rows.recording}': 'beside' names other coordinates than elsewhere"
        if not min(rows.variance, default=1.0) > 0.0:
            return f"rows of {rows.equation} in '{rows.recording}': a variance is not positive"
    return ""


def _guarded(machine: Stated, what: str, *arguments):
    """What a machine's function gives; whatever goes wrong in a file of the user's is one line."""
    try:
        return getattr(machine, what)(*arguments)
    except InputError:
        raise
    except Exception as problem:
        if machine.name in MEASURED:
            raise
        text = " ".join(str(problem).split())
        raise InputError(f"{machine.name}.{what}: {type(problem).__name__}: {text}") from None
