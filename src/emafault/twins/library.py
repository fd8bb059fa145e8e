"""The twins of measured machines by name, and the cases that a user's file holds."""

from importlib import import_module
from pathlib import Path

from emafault.errors import InputError
from emafault.twins.measured import Arrays, Distortion, MeasuredTwin

MEASURED = (
    "dq_machine",
    "six_step_bus",
    "propeller_sweep",
    "back_emf",
    "slow_rotation",
    "friction_axis",
    "induction_currents",
)


def _module(name: str):
    if name not in MEASURED:
        raise InputError(f"twin {name!r} is not known; known are {', '.join(MEASURED)}")
    return import_module(f"emafault.twins.{name}")


def read_cases(name: str, path: Path) -> dict[str, Arrays]:
    """Raw arrays of each case (machine or condition) of a file.

    Raises
    ------
    InputError
        when the twin is not known or the file is not what its twin needs.
    """
    if not Path(path).is_file():
        raise InputError(f"{path}: no such file")
    return _module(name).read(Path(path))


def build_twin(name: str, case: str, arrays: Arrays) -> MeasuredTwin:
    """The twin of one case.

    Raises
    ------
    InputError
        when the twin is not known or the arrays hold too little to fit and to hold out.
    """
    return _module(name).build(case, arrays)


def measured_twins(name: str, path: Path) -> dict[str, MeasuredTwin]:
    """The twin of each case of a file."""
    return {case: build_twin(name, case, arrays) for case, arrays in read_cases(name, path).items()}


def distortions(name: str) -> tuple[Distortion, ...]:
    """Known changes of a machine's raw arrays, with what should be named, for the withheld check."""
    return _module(name).distortions()
