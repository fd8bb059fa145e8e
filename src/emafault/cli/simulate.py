"""``emafault simulate``: a fault vector and overrides -> one recording file; or a bench -> its replay."""

import argparse
import re
from pathlib import Path

from . import whole_number
from .machine import add_actuator, with_actuator

#: groups of the configuration that a simulated recording depends on
READS = (
    "actuator", "command", "effects", "faults", "load", "magnet", "recording", "sensors", "temperature", "tolerances",
    "unit", "unlisted",
)  # fmt: skip


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser._negative_number_matcher = re.compile(r"^-\d*\.?\d+([eE][-+]?\d+)?$")  # argparse misses -2e-5
    parser.add_argument("file", help="netCDF file to write; with --replay the new folder of the replayed recordings")
    parser.add_argument(
        "overrides", nargs="*", metavar="OVERRIDE", help="Hydra overrides such as command=sine effects.stribeck.a=0.01"
    )
    add_actuator(parser)
    parser.add_argument(
        "--fault",
        nargs="+",
        default=[],
        metavar="VALUE",
        help="Na Nb Nc xi_x xi_y dT as six numbers, or only those that are not zero as Na=0.05 dT=30",
    )
    parser.add_argument(
        "--experiment", default="paper", metavar="NAME", help="experiment to start from, or such a file (paper)"
    )
    parser.add_argument(
        "--replay",
        metavar="BENCH",
        help="simulate each recording of a bench by its own command, start and temperature, with and without what the "
        "experiment corrects, and print what both differ by",
    )
    parser.add_argument("--seed", type=whole_number, default=0, help="of noise and start angle (0)")
    parser.add_argument("--unit-seed", type=whole_number, default=0, help="which unit, if unit=tolerance is given (0)")
    parser.add_argument("--unit", default="", help="name of the unit, kept in the file")
    parser.add_argument("--health", choices=["healthy", "unknown", "seeded"], help="what the file says of its fault")
    parser.add_argument("--force", action="store_true", help="replace the file if it exists")


def run(args: argparse.Namespace) -> None:
    """Simulate and write.

    Raises
    ------
    InputError : a fault or override that cannot be used, or a file that cannot be written
    """
    import json

    from .. import config
    from ..dataset import simulate_recording
    from ..io.recording import write_recording
    from ..places import refuse_output

    if args.replay:
        _replay(args)
        return
    fault, overrides = read_fault(args.fault)
    overrides = with_actuator(args, [*args.overrides, *overrides])
    config.refuse_unread(overrides, READS, "simulate")
    composed = config.compose(args.experiment, overrides)
    motion = [composed["command"]["path"]] if composed["command"]["name"] == "file" else []
    refuse_output(args.file, read=motion, force=args.force)
    spec = config.dataset_spec(composed, "fresh") | {"seed": args.seed, "unit_seed": args.unit_seed}
    recording = simulate_recording(spec, fault)
    attributes = recording.attributes | {"configuration": json.dumps(spec, sort_keys=True)}
    if args.health:
        attributes["health"] = args.health
    if args.unit:
        attributes["unit"] = args.unit
    write_recording(args.file, type(recording)(**{**vars(recording), "attributes": attributes}))
    print(f"{Path(args.file)}: {len(recording.time)} intervals of {recording.interval:g} s, fault {fault.tolist()}")


def _replay(args: argparse.Namespace) -> None:
    """Replay a bench and print what it differs by.

    Raises
    ------
    InputError : an option that a replay does not take, or a bench or experiment that cannot be used
    """
    from .. import config
    from ..equations.replay import replay_bench, table
    from ..errors import InputError

    if args.fault or args.health or args.unit:
        raise InputError("--replay: takes fault, health and unit from the bench, accepted are overrides and --seed")
    overrides = with_actuator(args, args.overrides)
    spec, plain = (config.replay_spec(config.compose(e, overrides)) for e in (args.experiment, "paper"))
    for each in (spec, plain):
        each["dataset"]["seed"] = args.seed
    compared, without = replay_bench(args.replay, args.file, spec, plain, Path(args.experiment).parent)
    print(table(compared, without))
    print(f"written to {args.file}")


def read_fault(words: list[str]):
    """Fault vector (6,) from six numbers or NAME=VALUE words; words of other names are overrides.

    Raises
    ------
    InputError : neither six numbers nor known components
    """
    import numpy as np

    from ..errors import InputError, shown
    from ..faults import FAULT_NAMES

    accepted = "six numbers (Na Nb Nc xi_x xi_y dT) or NAME=VALUE with these names"
    pairs = [word.split("=", 1) for word in words if "=" in word]
    numbers = [word for word in words if "=" not in word]
    named = [(name, text) for name, text in pairs if name in FAULT_NAMES]
    overrides = ["=".join(pair) for pair in pairs if pair[0] not in FAULT_NAMES]
    for name, _ in pairs:
        if "." not in name and name not in (*FAULT_NAMES, *READS):
            raise InputError(f"--fault: got '{shown(name)}', accepted are {accepted}")
    for name, _ in named:
        if [n for n, _ in named].count(name) > 1:
            raise InputError(f"--fault: {name} is given twice, accepted are {accepted}")
    if numbers and (named or len(numbers) != 6):
        raise InputError(f"--fault: got {shown(' '.join(words))}, accepted are {accepted}")
    fault = np.zeros(6)
    for name, text in [*named, *zip(FAULT_NAMES, numbers)]:
        try:
            value = float(text) if "_" not in text else float("nan")
        except ValueError:
            raise InputError(f"--fault: {name} got '{shown(text)}', accepted are {accepted}") from None
        low, high = (-200.0, 500.0) if name == "dT" else (-0.95, 0.95) if name.startswith("xi") else (0.0, 0.95)
        if not low <= value <= high:
            raise InputError(f"--fault: {name} got {shown(text)}, accepted is {low:g} to {high:g}")
        fault[FAULT_NAMES.index(name)] = value
    if np.hypot(*fault[3:5]) > 0.95:
        raise InputError(f"--fault: xi_x, xi_y got {fault[3]:g}, {fault[4]:g}, accepted is a length up to 0.95")
    return fault, overrides
