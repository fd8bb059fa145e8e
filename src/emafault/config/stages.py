"""The sub-tree of a composed configuration that each stage reads."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .composition import recursively_sorted

#: groups that diagnosing a bench reads
DIAGNOSED = ("actuator", "sensors", "tolerances", "tracking")
RUNS_OF_A_SHARD = 1000  # some 4 s of work and 280 MB for runs of 1 s
#: what a dataset is for -> its place in the sequence of seeds
PARTS = {"training": 0, "fresh": 1, "reference": 2}


def pick(tree: Mapping[str, Any], *names: str) -> dict[str, Any]:
    """Some of the keys of a mapping."""
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
        "recording": pick(recording, "duration", "interval", "theta_0"),
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
        "faults": pick(config["faults"], "N", "xi", "dT"),
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
        spec |= pick(config, "network", "training")
    return recursively_sorted(spec)


def search_spec(config: Mapping[str, Any]) -> dict[str, Any]:
    """What the search reads; the storage is where it is kept and changes no result."""
    search = {key: value for key, value in config["search"].items() if key not in ("workers", "storage")}
    return recursively_sorted(identification_spec(config) | pick(config, "network", "training") | {"search": search})


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
    return recursively_sorted(pick(config, *DIAGNOSED))


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
    return recursively_sorted(spec | pick(config, "faults", "network", "training"))
