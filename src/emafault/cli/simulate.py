"""``emafault simulate``: a fault vector and overrides -> one recording file; or a bench -> its replay."""

import argparse
import re
from pathlib import Path


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser._negative_number_matcher = re.compile(r"^-\d*\.?\d+([eE][-+]?\d+)?$")  # argparse misses -2e-5
    parser.add_argument("file", help="netCDF file to write; with --replay the new folder of the replayed recordings")
    parser.add_argument(
        "overrides", nargs="*", metavar="OVERRIDE", help="Hydra overrides such as command=sine effects.stribeck.a=0.01"
    )
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
    parser.add_argument("--seed", type=int, default=0, help="of noise and start angle (0)")
    parser.add_argument("--unit-seed", type=int, default=0, help="which unit, if unit=tolerance is given (0)")
    parser.add_argument("--unit", default="", help="name of the unit, kept in the file")
    parser.add_argument("--health", choices=["healthy", "unknown", "seeded"], help="what the file says of its fault")


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

    if args.replay:
        _replay(args)
        return
    fault, overrides = read_fault(args.fault)
    composed = config.compose(args.experiment, [*args.overrides, *overrides])
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
    spec, plain = (config.replay_spec(config.compose(e, args.overrides)) for e in (args.experiment, "paper"))
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

    from ..errors import InputError
    from ..faults import FAULT_NAMES

    named = {w.split("=")[0]: w.split("=")[1] for w in words if w.split("=")[0] in FAULT_NAMES and "=" in w}
    overrides = [w for w in words if "=" in w and w.split("=")[0] not in FAULT_NAMES]
    numbers = [w for w in words if "=" not in w]
    accepted = "six numbers (Na Nb Nc xi_x xi_y dT) or NAME=VALUE with these names"
    if numbers and (named or len(numbers) != 6):
        raise InputError(f"--fault: got {' '.join(words)}, accepted are {accepted}")
    fault = np.zeros(6)
    for name, text in [*named.items(), *zip(FAULT_NAMES, numbers)]:
        try:
            value = float(text)
        except ValueError:
            raise InputError(f"--fault: {name} got '{text}', accepted are {accepted}") from None
        low, high = (-200.0, 500.0) if name == "dT" else (-0.95, 0.95) if name.startswith("xi") else (0.0, 0.95)
        if not low <= value <= high:
            raise InputError(f"--fault: {name} got {value:g}, accepted is {low:g} to {high:g}")
        fault[FAULT_NAMES.index(name)] = value
    return fault, overrides
