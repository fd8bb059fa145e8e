"""Hydra configuration: composition, the sub-tree each stage reads, digests of the sources it runs.

Only this module, the command line and the Snakefile read configuration; everything else is handed one sub-tree.
"""

import functools
import hashlib
import shlex
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from . import checks, schema
from .effects import EFFECTS
from .errors import InputError, one_line, shown
from .paths import CONF
from .places import file_at, file_name, kind
from .plain import read_yaml

#: groups whose options are chosen as a whole: ``magnet=smco``; experiments are chosen apart
GROUPS = sorted(p.name for p in CONF.iterdir() if p.is_dir() and p.name not in ("effect", "experiment", "withheld"))
#: keys of a composed configuration
_KEYS = {*GROUPS, "name", "question", "dataset", "effects", "tolerances", "learnt_from", "variants"}
#: groups that diagnosing a bench reads
DIAGNOSED = ("actuator", "sensors", "tolerances", "tracking")
LONGEST_KEY = 200
_GIVEN = "emafault_given_experiment"
RUNS_OF_A_SHARD = 1000  # some 4 s of work and 280 MB for runs of 1 s
SHARDS_OF_A_BLOCK = 5  # that one job reconstructs, some 20 s of work
BENCHES_OF_A_BATCH = 20  # some 5 min of work
RANK_BINS = 20  # of the ranks of the check of the evidence
#: what a dataset is for -> its place in the sequence of seeds
PARTS = {"training": 0, "fresh": 1, "reference": 2}


def reference_actuator():
    """The nominal actuator of conf/actuator/reference.yaml."""
    from .actuator.parameters import ActuatorParameters

    return ActuatorParameters(**read_yaml(CONF / "actuator" / "reference.yaml"))


def experiments() -> list[str]:
    """Names of the experiments in conf/experiment."""
    return sorted(p.stem for p in (CONF / "experiment").glob("*.yaml"))


def recursively_sorted(value: Any) -> Any:
    """The same mappings with sorted keys, since Snakemake compares parameters in the order of their keys."""
    if isinstance(value, Mapping):
        return {str(key): recursively_sorted(value[key]) for key in sorted(value, key=str)}
    if isinstance(value, list | tuple):
        return [recursively_sorted(item) for item in value]
    return value


# --- composition ---------------------------------------------------------------------------------------------------


def split_overrides(overrides: str | Iterable[str] | None) -> list[str]:
    """One string of Hydra overrides, split as a shell would; a list of them is taken as it is.

    Raises
    ------
    InputError : an unclosed quote, or neither text nor a list of texts
    """
    if isinstance(overrides, str):
        try:
            return shlex.split(overrides)
        except ValueError as error:
            raise InputError(f"overrides: got {shown(repr(overrides))}, {error}") from error
    if overrides is not None and (
        not isinstance(overrides, list | tuple) or not all(isinstance(item, str) for item in overrides)
    ):
        raise InputError(f"overrides: got {shown(repr(overrides))}, accepted is text such as 'command=sine'")
    return list(overrides or [])


def refuse_unread(overrides: Iterable[str], read: Iterable[str], command: str) -> None:
    """Refuse overrides of groups that a command does not read, which would change nothing without a word.

    Raises
    ------
    InputError : naming the key and the groups that the command reads
    """
    for text in overrides:
        key = text.lstrip("+~").split("=")[0]
        if key.split(".")[0] not in read and key.split(".")[0] in _KEYS:
            raise InputError(f"{shown(key)}: is not read by {command}, which accepts {', '.join(sorted(read))}")


def compose(experiment: str = "paper", overrides: str | Iterable[str] | None = None) -> dict[str, Any]:
    """Compose and check one experiment.

    Parameters
    ----------
    experiment : a name in conf/experiment or the path of such a file (``.yaml``)
    overrides : Hydra overrides, as one string or a list; ``actuator=mine.yaml`` takes the file of an actuator (see
        ``datasheet``)

    Returns
    -------
    the configuration as plain, recursively sorted dictionaries

    Raises
    ------
    InputError : an unknown key, group option or experiment, or an impossible value
    """
    if not isinstance(experiment, str):
        raise InputError(f"experiment: got {shown(repr(experiment))}, accepted is a name or the path of a .yaml file")
    texts = split_overrides(overrides)
    keys = [text.lstrip("+~").split("=")[0] for text in texts]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{shown(key)}: is overridden twice, accepted is one value")
    return _composed(experiment, texts)


def _composed(experiment: str, overrides: list[str]) -> dict[str, Any]:
    """The same of overrides of which the last one counts."""
    path, given = _experiment_file(experiment)
    texts = [item for text in overrides for item in _of_actuator_file(text)]
    return _compose(path, path.read_text(encoding="utf-8") if given else "", tuple(texts))


def _of_actuator_file(text: str) -> list[str]:
    """An override; of one that names the file of an actuator those of its numbers."""
    key, _, value = text.partition("=")
    if key != "actuator" or not value.endswith((".yaml", ".yml")):
        return [text]
    from .datasheet.compose import of_file

    return of_file(file_at(value, "actuator")).overrides()


@functools.cache
def _compose(path: Path, text: str, overrides: tuple[str, ...]) -> dict[str, Any]:
    """Compose the experiment of conf/experiment, or the one of which this is the text."""
    import hydra
    import yaml
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    items = [_checked_override(item) for item in overrides]
    with (
        tempfile.TemporaryDirectory(prefix="emafault-") as folder,
        hydra.initialize_config_dir(str(CONF), version_base="1.3"),
    ):
        chosen = [f"experiment={path.stem}"]
        if text:  # under a name of our own, since Hydra reads null, 1 or a=b in names
            (Path(folder) / "experiment").mkdir()
            (Path(folder) / "experiment" / f"{_GIVEN}.yaml").write_text(text, encoding="utf-8")
            chosen = [f"experiment={_GIVEN}", f"hydra.searchpath=['file://{folder}']"]
        try:
            composed = hydra.compose("config", overrides=[*chosen, *items])
            config: Any = OmegaConf.to_container(composed, resolve=True, throw_on_missing=True)
        except (HydraException, OmegaConfBaseException, yaml.YAMLError, RecursionError, ValueError) as error:
            about = f"{shown(path)}: " if text and not overrides else ""
            said = _list_for_mapping(path, text) or _one_line(error, chosen, overrides)
            raise InputError(about + said.replace(_GIVEN, path.stem)) from error
    config["name"] = config["name"] or path.stem
    config["dataset"] = config["dataset"] or path.stem
    checks.check_configuration(config)
    return recursively_sorted(config) | {"variants": config["variants"]}  # variants keep their order


def _experiment_file(experiment: str) -> tuple[Path, bool]:
    """The file of an experiment, checked, and whether it was given as a path."""
    given = experiment.endswith((".yaml", ".yml"))
    if not given and experiment not in experiments():
        named = f"experiment: got '{shown(experiment)}'"
        raise InputError(f"{named}, accepted are {', '.join(experiments())} or the path of a .yaml file")
    path = file_at(experiment, "experiment") if given else CONF / "experiment" / f"{experiment}.yaml"
    checks.check_name(f"experiment: {shown(path)}: its name", path.stem, parts=1)
    read = read_yaml(path)
    defaults = read.get("defaults", [])
    if not isinstance(defaults, list) or not all(isinstance(entry, str | dict) for entry in defaults):
        raise InputError(
            f"{shown(path)}: defaults: got {shown(repr(defaults))}, accepted is a list of words and options"
        )
    chosen = [key for entry in defaults if isinstance(entry, dict) for key in entry]
    for key in chosen:
        if chosen.count(key) > 1:
            raise InputError(f"{shown(path)}: defaults: {shown(key)} is chosen twice, accepted is one option")
    for key in _unset(read):
        raise InputError(f"{shown(path)}: {key}: needs a value")
    if "hydra" in read:
        raise InputError(f"{shown(path)}: hydra: is not a key of an experiment")
    return path, given


def _unset(read: Mapping[str, Any], above: str = "") -> list[str]:
    """Keys that stand without a value."""
    found = []
    for key, value in read.items():
        if value == "???":
            found.append(f"{above}{key}")
        elif isinstance(value, Mapping):
            found += _unset(value, f"{above}{key}.")
    return found


def _checked_override(text: str) -> str:
    """One override, refused in one line if it cannot be read; effects may be added without a plus sign."""
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException

    try:
        (item,) = OverridesParser.create().parse_overrides([text])
    except HydraException as error:
        raise InputError(
            f"override {shown(repr(text))}: cannot be read, accepted is key=value or group=option"
        ) from error
    key = item.key_or_group
    if not key or len(key) > LONGEST_KEY:
        raise InputError(f"override {shown(repr(text))}: has no key that there could be, accepted is key=value")
    if item.package is not None or key.split(".")[0].split("/")[0] == "hydra":
        raise InputError(f"{shown(text)}: packages and Hydra's own keys are not accepted, key=value or group=option is")
    if item.is_sweep_override():
        raise InputError(f"{key}: got the sweep {text!r}, accepted is one value; a study's variants are an experiment")
    if key == "experiment":
        how = "--experiment NAME, or experiment=NAME beside overrides"
        raise InputError(f"experiment: is chosen by itself ({how}), not as an override")
    if key in GROUPS and not item.is_delete():
        options = sorted(p.stem for p in (CONF / key).glob("*.yaml"))
        chosen = item.value()
        for option in chosen if isinstance(chosen, list) and key == "reconstruction" else [chosen]:
            if option not in options:
                own = " or the path of a .yaml file" if key == "actuator" else ""
                raise InputError(f"{key}: got {option!r}, accepted is {', '.join(options)}{own}")
    if key.startswith(("effects.", "tolerances.")) and not text.startswith(("+", "~")):
        return f"++{text}"
    return text


def _list_for_mapping(path: Path, text: str) -> str:
    """What refuses an experiment that puts a list where keys are accepted, of which Hydra does not say where."""
    from hydra import compose as hydra_compose

    read: Any = OmegaConf.to_container(OmegaConf.create(text or path.read_text(encoding="utf-8")))
    pending: list[tuple[str, Any, Any]] = [("", read, OmegaConf.to_container(hydra_compose("config")))]
    while pending:
        above, read, base = pending.pop()
        for name, value in read.items():
            below = base.get(name)
            if isinstance(below, dict):
                key = f"{above}{name}"
                if isinstance(value, list):
                    return f"{key}: got {shown(repr(value))}, accepted is a mapping with {', '.join(map(str, below))}"
                if isinstance(value, dict):
                    pending.append((f"{key}.", value, below))
    return ""


def _one_line(error: Exception, chosen: list[str], overrides: tuple[str, ...]) -> str:
    """Hydra's refusal as one line; an unknown key is answered with the keys there are."""
    from hydra import compose as hydra_compose
    from hydra.errors import HydraException

    if isinstance(error, RecursionError):
        return "defaults: refer to themselves, accepted are other files"
    if getattr(error, "full_key", None) and "Missing mandatory value" in str(error):
        key = error.full_key  # type: ignore[attr-defined]
        return f"{key}: needs a value, accepted is {key}=VALUE"
    groups = [text for text in overrides if text.split("=")[0] in GROUPS]
    try:
        base = hydra_compose("config", overrides=[*chosen, *groups])
    except HydraException:  # the experiment itself is what is wrong
        return one_line(error)
    for text in overrides:
        words, node = text.lstrip("+~").split("=")[0].split("."), base
        for depth, word in enumerate(words):
            if not OmegaConf.is_dict(node):
                return f"{'.'.join(words)}: there is no such key; {'.'.join(words[:depth])} is a single value"
            if word not in node:
                return schema.unknown_key(".".join(words[depth:]), ".".join(words[:depth]), [str(k) for k in node])
            node = OmegaConf.select(base, ".".join(words[: depth + 1]))
    return one_line(error)


# --- stages --------------------------------------------------------------------------------------------------------


def _pick(tree: Mapping[str, Any], *names: str) -> dict[str, Any]:
    return {name: tree[name] for name in names}


def all_effects(config: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """The configured effects together with what the magnet and load groups stand for; ``effects`` has the last word."""
    magnet, load = config["magnet"], config["load"]
    merged: dict[str, dict[str, float]] = {}
    if magnet["coefficient"]:
        merged["magnet_temperature"] = {"alpha_m": magnet["coefficient"]}
    if load["constant"]:
        merged["load_constant"] = {"T": load["constant"]}
    if load["spring"]:
        merged["load_spring"] = {"c": load["spring"]}
    for effect, values in config["effects"].items():
        merged[effect] = merged.get(effect, {}) | dict(values)
    return merged


def dataset_spec(config: Mapping[str, Any], part: str) -> dict[str, Any]:
    """What simulating one part of a dataset reads; two parts with equal specs hold the same numbers."""
    sampling, unit, recording = config["sampling"], config["unit"], config["recording"]
    seed = 10 * sampling["seed"]
    spec: dict[str, Any] = {
        "actuator": config["actuator"],
        "command": dict(config["command"]),
        "faults": config["faults"],
        "magnet_lag": config["magnet"]["lag"],
        "effects": all_effects(config),
        "recording": _pick(recording, "duration", "interval", "theta_0"),
        "sensors": config["sensors"],
        "scheme": sampling["scheme"],
        "seed": seed + PARTS[part],
        "unit_seed": seed + (PARTS[part] if part == "training" else PARTS["fresh"]),
        "tolerance": unit["training_tolerance" if part == "training" else "tolerance"],
        "spread_of": unit["spread_of"],
        "healthy": part == "reference",
        "runs": sampling["runs"] if part == "training" else sampling["fresh"],
        "recordings_of_a_unit": unit["reference_recordings"] if part == "reference" else 1,
    }
    spec["shards"] = sampling["shards"] or number_of_shards(spec["runs"] * spec["recordings_of_a_unit"])
    for key in ("unlisted", "tolerances"):
        if config[key]:
            spec[key] = config[key]
    if recording["filter"]["kind"] != "none":
        spec["recording"]["filter"] = recording["filter"]
    if spec["command"]["name"] == "file":
        spec["command"]["digest"] = hashlib.sha256(Path(spec["command"]["path"]).read_bytes()).hexdigest()[:16]
    return recursively_sorted(spec)


def number_of_shards(runs: int) -> int:
    """Files that a part is cut into: none with more runs than ``RUNS_OF_A_SHARD``, and work for two jobs."""
    return min(runs, max(2, -(-runs // RUNS_OF_A_SHARD)))


def reconstruction_spec(config: Mapping[str, Any], method: str) -> dict[str, Any]:
    """What reconstructing with one entry of the group reconstruction reads."""
    return recursively_sorted({"settings": config["reconstruction"][method], "actuator": config["actuator"]})


def bound_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What the Cramer-Rao bounds of the fresh rows read: all samples that any least-squares method uses."""
    repeats = config["unit"]["reference_recordings"]
    methods = [entry for entry in config["reconstruction"].values() if entry["method"] != "paper"]
    spec = {
        "dataset": dataset_spec(config, "fresh"),
        "runs": min(config["evaluation"]["bound_runs"], config["sampling"]["fresh"]),
        "discard": min((entry["discard"] for entry in methods), default=config["recording"]["discard"]),
        "magnet_coefficient": magnet_coefficient(config),
        "known": known(config),
        "heating": any(entry.get("heating", False) for entry in methods),
        "reference": dataset_spec(config, "reference") if repeats else None,
        "ambient_error": config["sensors"]["ambient"],
    }
    return recursively_sorted(spec)


def examples_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What the recordings shown in the paper's figures read."""
    return recursively_sorted({"dataset": dataset_spec(config, "fresh"), "discard": config["recording"]["discard"]})


def magnet_coefficient(config: Mapping[str, Any]) -> float:
    """The magnets' temperature coefficient (1/K) that estimators are told."""
    return all_effects(config).get("magnet_temperature", {}).get("alpha_m", 0.0)


def identification_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What every estimator reads; networks add ``network_spec``, the search ``search_spec``."""
    spec = {
        "actuator": config["actuator"],
        "magnet_coefficient": magnet_coefficient(config),
        "known": known(config),
        "faults": _pick(config["faults"], "N", "xi", "dT"),
    }
    return recursively_sorted(spec)


def known(config: Mapping[str, Any]) -> dict[str, float]:
    """Relative standard deviations to which R0, k0 and L0 are known, and the magnets' expected lag with its own (K)."""
    low, high = config["magnet"]["lag"]["low"], config["magnet"]["lag"]["high"]
    return {**config["unit"]["known"], "lag": 0.5 * (low + high), "lag_deviation": (high - low) / 12.0**0.5}


def network_spec(config: Mapping[str, Any], estimator: str) -> dict[str, Any]:
    """What fitting an estimator reads; that of the search reads its network and training from what the search found."""
    spec, dataset = identification_spec(config), dataset_spec(config, "training")
    if dataset["tolerance"]:  # whose units differ
        spec["units"] = dataset
    if estimator != "closed_form":
        spec["seeds"] = config["evaluation"]["seeds"]
    if estimator == "network":
        spec |= _pick(config, "network", "training")
    return recursively_sorted(spec)


def search_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What the search reads; the storage is where it is kept and changes no result."""
    search = {key: value for key, value in config["search"].items() if key not in ("workers", "storage")}
    return recursively_sorted(identification_spec(config) | _pick(config, "network", "training") | {"search": search})


def evaluation_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What the evaluation reads."""
    methods = config["reconstruction"].items()
    spec = {
        "level": config["evaluation"]["level"],
        "ambient_error": config["sensors"]["ambient"],
        "draws": max(10, config["evaluation"]["seeds"]),
        "bounds": {name: _bound_beside(entry) for name, entry in methods},
    }
    return recursively_sorted(identification_spec(config) | spec)


def _bound_beside(entry: Mapping[str, Any]) -> str:
    """Which bound an entry of the group reconstruction stands beside, see ``study.features.compute_bound``."""
    if entry["method"] == "nine":
        return "heating" if entry["heating"] else "recording"
    return "plateau" if entry["method"] == "weighted" and not entry["floating"] else "floating"


def diagnosis_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What diagnosing a bench reads."""
    return recursively_sorted(_pick(config, *DIAGNOSED))


def _most_accurate(config: Mapping[str, Any]) -> dict[str, Any]:
    """The most accurate reconstruction that is configured."""
    methods = config["reconstruction"]
    return methods[next((m for m in ("weighted_floating", "weighted") if m in methods), list(methods)[-1])]


def replay_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What replaying a bench reads."""
    return recursively_sorted({"dataset": dataset_spec(config, "fresh"), "reconstruction": _most_accurate(config)})


def retraining_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What training a network for a diagnosed bench reads; the reconstruction is the most accurate configured."""
    spec = {
        "dataset": dataset_spec(config, "training"),
        "reconstruction": _most_accurate(config),
        "seeds": min(3, config["evaluation"]["seeds"]),
    }
    return recursively_sorted(spec | _pick(config, "faults", "network", "training"))


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
    return hashlib.sha256(repr(_pick(config, "actuator", "sensors")).encode()).hexdigest()[:8]


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
        from .machines.library import stated

        stated(call["twin"])


def withheld_draws() -> list[str]:
    """Names of the draws of blind cases in conf/withheld."""
    return sorted(path.stem for path in (CONF / "withheld").glob("*.yaml"))


def _withheld_draw(draw: str) -> dict[str, Any]:
    """A draw of conf/withheld."""
    return read_yaml(CONF / "withheld" / f"{draw}.yaml")


def check_draws() -> None:
    """Refuse draws of blind cases that share a case.

    Raises
    ------
    InputError : naming two draws, the rung and the seeds that they share
    """
    draws = {draw: _withheld_draw(draw) for draw in withheld_draws()}
    for (one, first), (other, second) in combinations(draws.items(), 2):
        for rung in first["cases"].keys() & second["cases"].keys() - {"T3"}:
            low = max(_of_rung(read["first_seed"], rung) for read in (first, second))
            high = min(_of_rung(read["first_seed"], rung) + read["cases"][rung] for read in (first, second))
            if low < high:
                raise InputError(f"withheld: the draws {one} and {other} share seeds {low} to {high - 1} of {rung}")


def _of_rung(value: Any, rung: str) -> int:
    """A number of a draw that is one for all its rungs or one for each."""
    return value[rung] if isinstance(value, dict) else value


def withheld_shows_measured(draw: str) -> bool:
    """Whether a draw's scoreboard shows the measured recordings too."""
    return bool(_withheld_draw(draw).get("measured", True))


def withheld_jobs(draw: str) -> list[tuple[str, int]]:
    """(rung, batch) of every job of a draw; T3 is made by the jobs of T1, whose benches it diagnoses."""
    read = _withheld_draw(draw)
    cases = {rung: count for rung, count in read["cases"].items() if rung != "T3"}
    return [(rung, n) for rung, count in cases.items() for n in range(-(-count // _of_rung(read["batch"], rung)))]


def withheld_spec(draw: str, rung: str, batch: int, config: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """What one job of blind cases reads: its seeds, the actuator with its tolerances and the sensors.

    ``again`` are those of T1 that T3 diagnoses too: whole rounds of the effects, spread over the draw. ``told`` are
    diagnosed a second time by a library of the truth alone, ``rivals`` have the distance to the nearest one computed.
    ``config`` composed is that of the actuator; None takes the reference actuator.
    """
    read = _withheld_draw(draw)
    origin, size = _of_rung(read["first_seed"], rung), _of_rung(read["batch"], rung)
    first = origin + batch * size
    last = min(first + size, origin + read["cases"][rung])
    config = config or compose()
    seeds: dict[str, Any] = {"rung": rung, "first": first, "last": last, "again": []}
    if rung == "T1":
        effects, left_out = len(EFFECTS), read["cases"].get("T3", 0)
        apart = max(1, read["cases"]["T1"] // max(left_out, 1))  # rounds from one that T3 takes to the next
        taken = [origin + effects * apart * (n // effects) + n % effects for n in range(left_out)]
        seeds["again"] = [seed for seed in taken if first <= seed < last]
    for name in ("told", "rivals"):
        every = read.get(name, {}).get(rung, 0)
        seeds[name] = [seed for seed in range(first, last) if every and (seed - origin) % every == 0]
    return recursively_sorted(_pick(config, "actuator", "sensors", "tolerances") | {"seeds": seeds})


def calibration_spec(config: Mapping[str, Any], overrides: str | Iterable[str] | None = None) -> dict[str, Any]:
    """What the check of the probabilities on an actuator reads: the actuator, its name and the cases of the draw."""
    read = _withheld_draw("own")
    spec = _pick(config, "actuator", "sensors", "tolerances") | _pick(read, "cases", "first_seed")
    return recursively_sorted(spec | {"name": actuator_name(overrides)[1]})


def actuator_name(overrides: str | Iterable[str] | None = None) -> tuple[str, str]:
    """Name of a folder and in words of the actuator of a configuration: those of its file, or the reference actuator's.

    Raises
    ------
    InputError : a file of an actuator that cannot be used
    """
    from .datasheet.compose import of_file

    for text in split_overrides(overrides):
        key, _, value = text.partition("=")
        if key == "actuator" and value.endswith((".yaml", ".yml")):
            return file_name(Path(value).stem), of_file(file_at(value, "actuator")).name
    return "reference", "reference actuator, 48 V"


def _evidence() -> dict[str, Any]:
    """The settings of conf/evidence.yaml.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    read = read_yaml(CONF / "evidence.yaml")
    schema.check(read, schema.Evidence, "evidence")
    if not read["benches"]:
        schema.refuse("evidence.benches", read["benches"], "a list of one seed or more")
    if (read["samples"] + 1) % RANK_BINS:
        schema.refuse("evidence.samples", read["samples"], f"one less than a multiple of {RANK_BINS}")
    return read


def evidence_spec() -> dict[str, Any]:
    """What the check of the evidence reads: its own settings, the actuator and the sensors."""
    return recursively_sorted(_pick(compose(), "actuator", "sensors") | {"evidence": _evidence()})


def _design() -> dict[str, Any]:
    """The settings of conf/optimal_command.yaml.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    read = read_yaml(CONF / "optimal_command.yaml")
    schema.check(read, schema.Design, "optimal_command")
    if not read["lengths"]:
        schema.refuse("optimal_command.lengths", read["lengths"], "a list of one length or more (s)")
    for name, ends in read["space"].items():
        if name not in schema.COMMANDS or name == "file":
            raise InputError(schema.unknown_key(name, "optimal_command.space", schema.COMMANDS.keys() - {"file"}))
        for end in ("low", "high"):
            settings = {"name": name, **{key: float(value[end]) for key, value in ends.items()}}
            schema.check(settings, schema.COMMANDS[name], f"optimal_command.space.{name}")
    return read


def design_lengths() -> list[float]:
    """Lengths (s) of recording for which a command is searched."""
    return _design()["lengths"]


def design_spec() -> dict[str, Any]:
    """What the search for the command that identifies best reads."""
    design = _design()
    config = compose(design["experiment"], ["reconstruction=[weighted_floating,nine]"])
    spec = {
        "design": design,
        "dataset": dataset_spec(config, "fresh"),
        "known": known(config),
        "magnet_coefficient": magnet_coefficient(config),
    }
    return recursively_sorted(spec)


def several_spec() -> dict[str, Any]:
    """What identifying one fault from several recordings reads: conf/several_recordings.yaml and its experiments.

    Raises
    ------
    InputError : naming the key, what it got and what it accepts
    """
    read = read_yaml(CONF / "several_recordings.yaml")
    schema.check(read, schema.Several, "several_recordings")
    if not read["counts"]:
        schema.refuse("several_recordings.counts", read["counts"], "a list of one number or more")
    own = []
    for name in read.pop("experiments"):
        config = compose(name)
        parts = {"dataset": dataset_spec(config, "fresh"), "known": known(config), "name": name}
        own.append(parts | {"alpha_m": magnet_coefficient(config), "question": config["question"]})
    return recursively_sorted({"settings": read, "experiments": own})


@dataclass(frozen=True)
class Case:
    """One composed configuration and where its results stand.

    ``path`` is the experiment's name, for a study followed by the variant's; ``datasets`` maps each part to the name of
    the dataset that holds it, which may be one that another experiment simulates likewise; ``learnt`` is the path of
    the case whose estimators are evaluated, mostly its own.
    """

    path: str
    config: Mapping[str, Any]
    datasets: Mapping[str, str]
    learnt: str

    @property
    def parts(self) -> list[str]:
        """The parts of a dataset that this case needs."""
        return list(self.datasets)


@dataclass(frozen=True)
class Plan:
    """Everything one call of the workflow composes: an experiment, or a study with its variants."""

    name: str
    question: str
    cases: tuple[Case, ...]

    @property
    def is_study(self) -> bool:
        return [case.path for case in self.cases] != [self.name]

    def dataset(self, name: str, part: str) -> dict[str, Any]:
        """Spec of a dataset's part."""
        return next(dataset_spec(c.config, part) for c in self.cases if c.datasets.get(part) == name)

    def case(self, path: str) -> Case:
        return next(case for case in self.cases if case.path == path)

    @property
    def learnt_from(self) -> str | None:
        """The variant whose estimators others are evaluated with, None where each has its own."""
        others = [case.learnt for case in self.cases if case.learnt != case.path]
        return others[0].split("/")[-1] if others else None


def plan(experiment: str = "paper", overrides: str | Iterable[str] | None = None) -> Plan:
    """Compose an experiment and, if it is a study, each of its variants.

    Raises
    ------
    InputError : as ``compose``; also one dataset name composed in two ways, or draws of blind cases that share one
    """
    check_draws()
    _evidence()
    _design()
    texts = split_overrides(overrides)
    top = compose(experiment, texts)
    if top["variants"]:
        configs = {f"{top['name']}/{v}": _composed(experiment, [*texts, *more]) for v, more in top["variants"].items()}
    else:
        configs = {top["name"]: top}
    cases: list[Case] = []
    specs: dict[tuple[str, str], dict[str, Any]] = {}
    for path, config in configs.items():
        case = Case(path, config, _datasets(path, config), _learnt(top["name"], path, configs))
        for part, dataset in case.datasets.items():
            spec = dataset_spec(config, part)
            if specs.setdefault((dataset, part), spec) != spec:
                raise InputError(f"dataset: '{dataset}' is composed in two ways; give one of them a name of its own")
        cases.append(case)
    return Plan(top["name"], top["question"], tuple(cases))


def _learnt(study: str, path: str, configs: Mapping[str, Mapping[str, Any]]) -> str:
    """Path of the case whose estimators a case evaluates."""
    wanted = configs[path]["learnt_from"]
    if wanted is None:
        return path
    own = [p.split("/")[-1] for p, c in configs.items() if p != study and c["learnt_from"] is None]
    if wanted not in own:
        accepted = ", ".join(own) or "none, for it is no study or all its variants name another"
        raise InputError(f"learnt_from: '{shown(wanted)}' is no variant that learns itself, accepted are {accepted}")
    owner = f"{study}/{wanted}"
    if configs[owner]["reconstruction"] != configs[path]["reconstruction"]:
        raise InputError(
            f"learnt_from: {path} and {owner} do not have the same reconstruction, they cannot be compared"
        )
    return owner


def _datasets(path: str, config: Mapping[str, Any]) -> dict[str, str]:
    """Each part under the name that ``dataset`` gives where that experiment simulates the same, else under its own."""
    needed = {"reference": config["unit"]["reference_recordings"], "training": config["learnt_from"] is None}
    parts = [p for p in PARTS if needed.get(p, True)]
    owner = config["dataset"]
    if owner == path:
        return dict.fromkeys(parts, path)
    shared = compose(owner) if owner in experiments() else config
    return {p: owner if dataset_spec(shared, p) == dataset_spec(config, p) else path for p in parts}
