"""What a call of the workflow sets, and the files of benches that it names."""

import functools
import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from .. import schema
from ..errors import InputError, shown
from ..places import file_at, file_name, kind
from .stages import pick

BENCHES_OF_A_BATCH = 20  # some 5 min of work


def bench_name(bench: str) -> str:
    """Name under which a bench's diagnosis stands among the results."""
    path = Path(bench)
    return file_name((path.resolve().name if path.is_dir() else path.stem) or "none")


def bench_files(bench: str) -> list[str]:
    """Files of a bench, in order of name, for the workflow.

    Raises
    ------
    InputError : no bench given, a path that does not exist, or one with braces, which Snakemake reads as wildcards
    """
    if not bench:
        raise InputError("bench: none given, --config bench=PATH names a folder of recordings")
    found = kind(bench, "bench")
    if found not in ("file", "folder"):
        raise InputError(f"bench: {shown(bench)}: no such file or folder")
    files = [bench]
    if found == "folder":
        files = sorted(str(p) for p in Path(bench).iterdir() if p.is_file() and not p.name.startswith("."))
    for file in files:
        if set(file) & set("{}"):
            raise InputError(f"bench: {shown(file)}: the workflow accepts no braces, emafault diagnose does")
    return files


def command_files(config: Mapping[str, Any]) -> list[str]:
    """The file that the command is read from, if it is given as one, for the workflow.

    Raises
    ------
    InputError : a path with braces, which Snakemake reads as wildcards
    """
    command = config["command"]
    if command["name"] != "file":
        return []
    if set(command["path"]) & set("{}"):
        raise InputError(f"command.path: {shown(command['path'])}: the workflow accepts no braces")
    return [command["path"]]


@functools.cache
def batches(folder: str) -> list[list[str]]:
    """Benches of a fleet, folders of recordings in a folder, in the batches that jobs diagnose.

    Raises
    ------
    InputError : no folder given, none of recordings in it, or one whose path the workflow cannot take
    """
    if not folder:
        raise InputError("benches: none given, --config benches=DIR names a folder of benches")
    if kind(folder, "benches") != "folder":
        raise InputError(f"benches: {shown(folder)}: no such folder")
    found = [str(p) for p in sorted(Path(folder).iterdir()) if p.is_dir() and any(p.glob("*.nc"))]
    if not found:
        raise InputError(f"benches: {shown(folder)}: holds no folder with recordings (*.nc)")
    return [found[n : n + BENCHES_OF_A_BATCH] for n in range(0, len(found), BENCHES_OF_A_BATCH)]


def batch_files(benches: Iterable[str]) -> list[str]:
    """Recordings of benches, for the workflow.

    Raises
    ------
    InputError : as ``bench_files``
    """
    return [file for bench in benches for file in bench_files(bench) if file.endswith(".nc")]


def fleet_digest(config: Mapping[str, Any]) -> str:
    """What tells rows of a fleet apart that were made by another configuration."""
    return hashlib.sha256(repr(pick(config, "actuator", "sensors")).encode()).hexdigest()[:8]


#: what ``snakemake --config`` may set
CALL = ("experiment", "overrides", "bench", "benches", "twin", "calibration")


def check_call(call: Mapping[str, Any]) -> None:
    """Refuse what a call of the workflow sets, before anything runs.

    Parameters
    ----------
    call : what stands behind ``snakemake --config``

    Raises
    ------
    InputError : a key that nothing reads, or a bench or machine that there is not
    """
    for key, value in call.items():
        if key not in CALL:
            raise InputError(schema.unknown_key(key, "", CALL).replace("the configuration", "--config"))
        if key in ("bench", "benches", "twin", "calibration") and not isinstance(value, str):
            raise InputError(f"{key}: got {shown(repr(value))}, accepted is one word")
    if call.get("bench"):
        bench_files(call["bench"])
    if call.get("benches"):
        batches(call["benches"])
    if call.get("calibration"):
        file_at(call["calibration"], "calibration")
        if call.get("twin", "actuator") != "actuator":
            raise InputError("calibration: only probabilities of an actuator are checked, accepted without a twin")
    if call.get("twin", "actuator") != "actuator":
        from ..machines.library import stated

        stated(call["twin"])
