"""Hydra configuration: composition, the sub-tree each stage reads, digests of the sources it runs.

Only this module, the command line and the Snakefile read configuration; everything else is handed one sub-tree.
"""

import ast
import fcntl
import functools
import hashlib
import os
import shlex
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import IO, Any

from omegaconf import OmegaConf

from . import schema
from .errors import InputError

ROOT = Path(__file__).resolve().parents[2]
CONF = ROOT / "conf"
PACKAGE = Path(__file__).resolve().parent
#: groups whose options are chosen as a whole: ``magnet=smco``; experiments are chosen apart
GROUPS = sorted(p.name for p in CONF.iterdir() if p.is_dir() and p.name not in ("effect", "experiment", "withheld"))
#: what a dataset is for -> its place in the sequence of seeds
PARTS = {"training": 0, "fresh": 1, "reference": 2}


def reference_actuator():
    """The nominal actuator of conf/actuator/reference.yaml."""
    from .actuator.parameters import ActuatorParameters

    return ActuatorParameters(**OmegaConf.to_container(OmegaConf.load(CONF / "actuator" / "reference.yaml")))  # type: ignore[arg-type]


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


def check_writable(folder: str | Path) -> None:
    """Refuse, before anything runs, results that cannot be written.

    Raises
    ------
    InputError : the folder is a file, or is read-only
    """
    path = Path(folder)
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: is not a folder, results cannot be written there")
    nearest = next(p for p in (path, *path.absolute().parents) if p.exists())
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError(f"{path}: is read-only, results cannot be written there")


_claims: list[IO[str]] = []  # held as long as the process lives


def claim(folder: str | Path) -> None:
    """Claim a folder of results for this process; a killed process leaves no claim behind, unlike a lock file.

    Raises
    ------
    InputError : another process is at work there
    """
    Path(folder).mkdir(parents=True, exist_ok=True)
    file = open(Path(folder) / ".lock", "w")
    _claims.append(file)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(f"{folder}: another run is at work there, wait until it has ended") from None


# --- composition ---------------------------------------------------------------------------------------------------


def split_overrides(overrides: str | Iterable[str] | None) -> list[str]:
    """One string of Hydra overrides, split as a shell would; a list is taken as it is.

    Raises
    ------
    InputError : an unclosed quote
    """
    if isinstance(overrides, str):
        try:
            return shlex.split(overrides)
        except ValueError as error:
            raise InputError(f"overrides: got {overrides!r}, {error}") from error
    return [str(item) for item in overrides or []]


def compose(experiment: str = "paper", overrides: str | Iterable[str] | None = None) -> dict[str, Any]:
    """Compose and check one experiment.

    Parameters
    ----------
    experiment : a name in conf/experiment or the path of such a file (``.yaml``)
    overrides : Hydra overrides, as one string or a list

    Returns
    -------
    the configuration as plain, recursively sorted dictionaries

    Raises
    ------
    InputError : an unknown key, group option or experiment, or an impossible value
    """
    return _compose(str(experiment), tuple(split_overrides(overrides)))


@functools.cache
def _compose(experiment: str, overrides: tuple[str, ...]) -> dict[str, Any]:
    import hydra
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    name, folder = _experiment_file(experiment)
    items = [_checked_override(text) for text in overrides]
    search = [f"hydra.searchpath=[file://{folder}]"] if folder else []
    with hydra.initialize_config_dir(str(CONF), version_base="1.3"):
        try:
            composed = hydra.compose("config", overrides=[f"experiment={name}", *search, *items])
            config: Any = OmegaConf.to_container(composed, resolve=True, throw_on_missing=True)
        except (HydraException, OmegaConfBaseException) as error:
            raise InputError(_one_line(error, name, search, overrides)) from error
        finally:
            if folder:
                shutil.rmtree(folder, ignore_errors=True)
    config["name"] = config["name"] or name
    config["dataset"] = config["dataset"] or name
    _check(config)
    return recursively_sorted(config) | {"variants": config["variants"]}  # variants keep their order


def _experiment_file(experiment: str) -> tuple[str, str | None]:
    """Name of an experiment, and for one given as a path a temporary folder in which Hydra finds it."""
    if not experiment.endswith((".yaml", ".yml")):
        if experiment not in experiments():
            raise InputError(
                f"experiment: got '{experiment}', accepted are {', '.join(experiments())} or the path of a .yaml file"
            )
        return experiment, None
    path = Path(experiment)
    if not path.is_file():
        raise InputError(f"experiment: {path}: no such file")
    folder = Path(tempfile.mkdtemp(prefix="emafault-"))
    (folder / "experiment").mkdir()
    shutil.copy(path, folder / "experiment" / f"{path.stem}.yaml")
    return path.stem, str(folder)


def _checked_override(text: str) -> str:
    """One override, refused in one line if it cannot be read; effects may be added without a plus sign."""
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException

    try:
        (item,) = OverridesParser.create().parse_overrides([text])
    except HydraException as error:
        raise InputError(f"override {text!r}: cannot be read, accepted is key=value or group=option") from error
    key = item.key_or_group
    if item.is_sweep_override():
        raise InputError(f"{key}: got the sweep {text!r}, accepted is one value; a study's variants are an experiment")
    if key == "experiment":
        raise InputError("experiment: is chosen by itself (experiment=NAME beside overrides), not as an override")
    if key in GROUPS and not item.is_delete():
        options = sorted(p.stem for p in (CONF / key).glob("*.yaml"))
        chosen = item.value()
        for option in chosen if isinstance(chosen, list) else [chosen]:
            if option not in options:
                raise InputError(f"{key}: got {option!r}, accepted is {', '.join(options)}")
    if key.startswith("effects.") and not text.startswith(("+", "~")):
        return f"++{text}"
    return text


def _one_line(error: Exception, name: str, search: list[str], overrides: tuple[str, ...]) -> str:
    """Hydra's refusal as one line; an unknown key is answered with the keys there are."""
    from hydra import compose as hydra_compose

    if getattr(error, "full_key", None) and "Missing mandatory value" in str(error):
        key = error.full_key  # type: ignore[attr-defined]
        return f"{key}: needs a value, accepted is {key}=VALUE"
    groups = [text for text in overrides if text.split("=")[0] in GROUPS]
    base = hydra_compose("config", overrides=[f"experiment={name}", *search, *groups])
    for text in overrides:
        words, node = text.lstrip("+~").split("=")[0].split("."), base
        for depth, word in enumerate(words):
            if not OmegaConf.is_dict(node):
                return f"{'.'.join(words)}: there is no such key; {'.'.join(words[:depth])} is a single value"
            if word not in node:
                return schema.unknown_key(".".join(words[depth:]), ".".join(words[:depth]), [str(k) for k in node])
            node = OmegaConf.select(base, ".".join(words[: depth + 1]))
    return " ".join(str(error).split())


# --- checks --------------------------------------------------------------------------------------------------------

_SCHEMAS = {
    "actuator": schema.Actuator,
    "faults": schema.Faults,
    "magnet": schema.Magnet,
    "load": schema.Load,
    "recording": schema.RecordingConditions,
    "sensors": schema.Sensors,
    "unit": schema.Unit,
    "sampling": schema.Sampling,
    "network": schema.Network,
    "training": schema.Training,
    "search": schema.Search,
    "evaluation": schema.Evaluation,
    "tracking": schema.Tracking,
    "effects": dict[str, dict[str, float]],
    "variants": dict[str, list[str]],
    "name": str,
    "dataset": str,
}


def _check(config: dict[str, Any]) -> None:
    known = {*_SCHEMAS, "command", "reconstruction", "question"}
    for key in config:
        if key not in known:
            raise InputError(schema.unknown_key(key, "", sorted(known)))
    for key in known - config.keys():
        raise InputError(f"{key}: is missing from the configuration")
    for key, kind in _SCHEMAS.items():
        schema.check(config[key], kind, key)
    for key in ("name", "dataset"):
        if not all(word and set(word) <= _NAME and word[0] != "." for word in config[key].split("/")):
            schema.refuse(key, config[key], "letters, digits, _, - and .")
    _check_named("command", config["command"], "name", schema.COMMANDS)
    schema.check(config["reconstruction"], dict[str, dict[str, Any]], "reconstruction")
    for name, entry in config["reconstruction"].items():
        _check_named(f"reconstruction.{name}", entry, "method", schema.RECONSTRUCTIONS)
    if config["command"]["name"] == "file" and not Path(config["command"]["path"]).is_file():
        schema.refuse("command.path", config["command"]["path"], "the path of an existing file")
    _check_effects(config["effects"])
    recording = config["recording"]
    intervals = recording["duration"] / recording["interval"]
    if abs(intervals - round(intervals)) > 1e-6:
        schema.refuse(
            "recording.duration", recording["duration"], f"a whole number of {recording['interval']} s intervals"
        )
    if recording["discard"] > recording["duration"] - 0.15:
        schema.refuse("recording.discard", recording["discard"], "at least 0.15 s less than recording.duration")
    if config["sampling"]["shards"] > min(config["sampling"]["runs"], config["sampling"]["fresh"]):
        schema.refuse("sampling.shards", config["sampling"]["shards"], "no more than sampling.runs and sampling.fresh")
    _check_space(config["search"]["space"])
    if config["search"]["reconstruction"] not in config["reconstruction"] and config["search"]["trials"]:
        schema.refuse(
            "search.reconstruction", config["search"]["reconstruction"], ", ".join(sorted(config["reconstruction"]))
        )


_NAME = set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.")


def _check_space(space: Mapping[str, Mapping[str, Any]]) -> None:
    """Check that every end and every value of the space that is searched is one that the setting accepts."""
    groups = {"network": schema.Network, "training": schema.Training}
    for section, keys in space.items():
        if section not in groups:
            raise InputError(schema.unknown_key(section, "search.space", list(groups)))
        known = {field.name: field for field in fields(groups[section])}
        for name, values in keys.items():
            key = f"search.space.{section}.{name}"
            if name not in known:
                raise InputError(schema.unknown_key(name, f"search.space.{section}", list(known)))
            if isinstance(values, Mapping):
                if not {"low", "high"} <= set(values) <= {"low", "high", "log", "step"}:
                    schema.refuse(key, values, "a list of values, or low, high and at will log and step")
                if values["low"] > values["high"]:
                    schema.refuse(f"{key}.high", values["high"], f"a number not below {key}.low = {values['low']}")
                values = [values["low"], values["high"]]
            for value in values if isinstance(values, list) else [values]:
                schema.check(value, known[name].type, key, known[name].metadata)


def _check_named(key: str, value: Mapping[str, Any], label: str, schemas: Mapping[str, type]) -> None:
    """Check a group whose entry ``label`` says which schema holds."""
    chosen = value.get(label) if isinstance(value, Mapping) else value
    if not isinstance(chosen, str) or chosen not in schemas:
        schema.refuse(f"{key}.{label}", chosen, ", ".join(schemas))
    schema.check(value, schemas[chosen], key)


def _check_effects(effects: Mapping[str, Mapping[str, float]]) -> None:
    from .effects import EFFECTS

    for effect, values in effects.items():
        if effect not in EFFECTS:
            raise InputError(schema.unknown_key(effect, "effects", list(EFFECTS)))
        for name in values:
            if name not in EFFECTS[effect].parameters:
                raise InputError(schema.unknown_key(name, f"effects.{effect}", list(EFFECTS[effect].parameters)))


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
        "shards": sampling["shards"],
        "seed": seed + PARTS[part],
        "unit_seed": seed + (PARTS[part] if part == "training" else PARTS["fresh"]),
        "tolerance": unit["training_tolerance" if part == "training" else "tolerance"],
        "healthy": part == "reference",
        "runs": sampling["runs"] if part == "training" else sampling["fresh"],
        "recordings_of_a_unit": unit["reference_recordings"] if part == "reference" else 1,
    }
    if spec["command"]["name"] == "file":
        spec["command"]["digest"] = hashlib.sha256(Path(spec["command"]["path"]).read_bytes()).hexdigest()[:16]
    return recursively_sorted(spec)


def reconstruction_spec(config: Mapping[str, Any], method: str) -> dict[str, Any]:
    """What reconstructing with one entry of the group reconstruction reads."""
    return recursively_sorted({"settings": config["reconstruction"][method], "actuator": config["actuator"]})


def bound_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What the Cramer-Rao bound of the fresh rows reads."""
    spec = {
        "dataset": dataset_spec(config, "fresh"),
        "runs": min(config["evaluation"]["bound_runs"], config["sampling"]["fresh"]),
        "discard": config["recording"]["discard"],
        "magnet_coefficient": magnet_coefficient(config),
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
        "magnet_lag": 0.5 * (config["magnet"]["lag"]["low"] + config["magnet"]["lag"]["high"]),
        "faults": _pick(config["faults"], "N", "xi", "dT"),
    }
    return recursively_sorted(spec)


def network_spec(config: Mapping[str, Any], estimator: str) -> dict[str, Any]:
    """What fitting an estimator reads; that of the search reads its network and training from what the search found."""
    spec = identification_spec(config)
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
        "plateau_only": {name: entry["method"] == "weighted" and not entry["floating"] for name, entry in methods},
    }
    return recursively_sorted(identification_spec(config) | spec)


def diagnosis_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What diagnosing a bench reads."""
    return recursively_sorted(_pick(config, "actuator", "sensors", "tracking"))


def withheld_draws() -> list[str]:
    """Names of the draws of blind cases in conf/withheld."""
    return sorted(path.stem for path in (CONF / "withheld").glob("*.yaml"))


def _withheld_draw(draw: str) -> dict[str, Any]:
    return OmegaConf.to_container(OmegaConf.load(CONF / "withheld" / f"{draw}.yaml"))  # type: ignore[return-value]


def withheld_jobs(draw: str) -> list[tuple[str, int]]:
    """(rung, batch) of every job of a draw."""
    read = _withheld_draw(draw)
    return [(rung, n) for rung, cases in read["cases"].items() for n in range(-(-cases // read["batch"]))]


def withheld_spec(draw: str, rung: str, batch: int) -> dict[str, Any]:
    """What one job of blind cases reads: its seeds, the actuator and the sensors."""
    read = _withheld_draw(draw)
    first, size = read["first_seed"] + batch * read["batch"], read["batch"]
    last = min(first + size, read["first_seed"] + read["cases"][rung])
    config = compose()
    seeds = {"rung": rung, "first": first, "last": last}
    return recursively_sorted(_pick(config, "actuator", "sensors") | {"seeds": seeds})


@dataclass(frozen=True)
class Case:
    """One composed configuration and where its results stand.

    ``path`` is the experiment's name, for a study followed by the variant's; ``datasets`` maps each part to the name of
    the dataset that holds it, which may be one that another experiment simulates likewise.
    """

    path: str
    config: Mapping[str, Any]
    datasets: Mapping[str, str]

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


def plan(experiment: str = "paper", overrides: str | Iterable[str] | None = None) -> Plan:
    """Compose an experiment and, if it is a study, each of its variants.

    Raises
    ------
    InputError : as ``compose``; also one dataset name composed in two ways
    """
    texts = split_overrides(overrides)
    top = compose(experiment, texts)
    if top["variants"]:
        configs = {f"{top['name']}/{v}": compose(experiment, [*texts, *more]) for v, more in top["variants"].items()}
    else:
        configs = {top["name"]: top}
    cases: list[Case] = []
    specs: dict[tuple[str, str], dict[str, Any]] = {}
    for path, config in configs.items():
        case = Case(path, config, _datasets(path, config))
        for part, dataset in case.datasets.items():
            spec = dataset_spec(config, part)
            if specs.setdefault((dataset, part), spec) != spec:
                raise InputError(f"dataset: '{dataset}' is composed in two ways; give one of them a name of its own")
        cases.append(case)
    return Plan(top["name"], top["question"], tuple(cases))


def _datasets(path: str, config: Mapping[str, Any]) -> dict[str, str]:
    """Each part under the name that ``dataset`` gives where that experiment simulates the same, else under its own."""
    parts = [p for p in PARTS if p != "reference" or config["unit"]["reference_recordings"]]
    owner = config["dataset"]
    if owner == path:
        return dict.fromkeys(parts, path)
    shared = compose(owner) if owner in experiments() else config
    return {p: owner if dataset_spec(shared, p) == dataset_spec(config, p) else path for p in parts}


# --- sources -------------------------------------------------------------------------------------------------------


@functools.cache
def source_digest(script: str | Path) -> str:
    """Digest of a script and of every module of this package that it imports, directly or not.

    Comments, docstrings and layout do not count. Where the catalogue of effects is imported, its files count.
    """
    pending, seen = [Path(script)], {}
    while pending:
        path = pending.pop()
        if path not in seen:
            seen[path], imported = _read_source(path)
            pending += imported
    digest = hashlib.sha256("".join(seen[path] for path in sorted(seen)).encode())
    if PACKAGE / "effects" / "__init__.py" in seen:
        for path in sorted((CONF / "effect").glob("*.yaml")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@functools.cache
def _read_source(path: Path) -> tuple[str, list[Path]]:
    """Digest of what a module means and the files of this package that it imports."""
    tree = ast.parse(path.read_bytes())
    imported = _imports(tree, path)
    return hashlib.sha256(_meaning(tree).encode()).hexdigest(), imported


def _meaning(tree: ast.AST) -> str:
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            value = body[0].value
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                body[0] = ast.Pass()
    return ast.dump(tree)


def _imports(tree: ast.AST, path: Path) -> list[Path]:
    """Files of this package that a module imports anywhere, its packages' own included."""
    dotted = ""
    if path.is_relative_to(PACKAGE):
        dotted = ".".join(("emafault", *path.relative_to(PACKAGE).with_suffix("").parts))
        dotted = dotted if path.name != "__init__.py" else dotted.removesuffix(".__init__") + "._"
    names = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parent = ".".join(dotted.split(".")[: -node.level]) if node.level else ""
            module = ".".join(part for part in (parent, node.module or "") if part)
            names += [module, *(f"{module}.{alias.name}" for alias in node.names)]
    found = []
    for name in names:
        words = name.split(".")
        if words[0] == "emafault":
            for depth in range(1, len(words) + 1):
                stem = PACKAGE.joinpath(*words[1:depth])
                found += [p for p in (stem / "__init__.py", stem.with_suffix(".py")) if p.is_file() and stem != p]
    return found
