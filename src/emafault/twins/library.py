"""The twins of measured machines by name, and the cases that a user's file holds."""

from importlib import import_module
from pathlib import Path

from emafault.errors import InputError
from emafault.gap.decide import Calibration
from emafault.twins.measured import Arrays, Distortion, MeasuredTwin
from emafault.twins.measured_experiments import Bench

MEASURED = (
    "dq_machine",
    "six_step_bus",
    "propeller_sweep",
    "back_emf",
    "slow_rotation",
    "friction_axis",
    "induction_currents",
)

#: what is believed of each machine's verdicts (see ``study.calibrate_measured``), and of one that has not been redrawn
CALIBRATIONS = Path(__file__).with_name("calibrations")
SHARED = "shared"


def _module(name: str):
    if name not in MEASURED:
        raise InputError(f"twin {name!r} is not known; known are {', '.join(MEASURED)}")
    return import_module(f"emafault.twins.{name}")


def read_cases(name: str, path: Path) -> dict[str, Arrays]:
    """Raw arrays of each case (machine or condition) of a file, or of the files of a folder that the twin can read.

    Raises
    ------
    InputError
        when the twin is not known, the file is not what its twin needs, or no file of the folder is.
    """
    module, path = _module(name), Path(path)
    if path.is_file():
        return module.read(path)
    if not path.is_dir():
        raise InputError(f"{path}: no such file or folder")
    cases: dict[str, Arrays] = {}
    refused = ""
    for file in sorted(path.iterdir()):
        if not file.name.endswith((".npz", ".csv", ".csv.gz")):
            continue
        try:
            found = module.read(file)
        except InputError as problem:
            refused = refused or str(problem)
            continue
        cases |= {case if case not in cases else f"{file.name}: {case}": arrays for case, arrays in found.items()}
    if not cases:
        raise InputError(f"{path}: no file that twin {name!r} reads" + (f" ({refused})" if refused else ""))
    return cases


def build_twin(name: str, case: str, arrays: Arrays) -> MeasuredTwin:
    """The twin of one case.

    Raises
    ------
    InputError
        when the twin is not known or the arrays hold too little to fit and to hold out.
    """
    return _module(name).build(case, arrays)


def calibration_of(name: str) -> Calibration:
    """The frozen curves of a twin; those of all twins together where it has none of its own."""
    own = CALIBRATIONS / f"{name}.json"
    return Calibration.load(own if own.exists() else CALIBRATIONS / f"{SHARED}.json")


def measured_twins(name: str, path: Path) -> dict[str, MeasuredTwin]:
    """The twin of each case of a file."""
    return {case: build_twin(name, case, arrays) for case, arrays in read_cases(name, path).items()}


def bench(twin: MeasuredTwin) -> Bench:
    """What could be recorded next of a machine."""
    return Bench(twin, _module(twin.name).experiments())


def distortions(name: str) -> tuple[Distortion, ...]:
    """Known changes of a machine's raw arrays, with what should be named, for the withheld check."""
    return _module(name).distortions()
