"""Files of results that were cut short, edited or are of another kind."""

from collections.abc import Callable
from typing import Any

from .entries import Entry, Prepare, entry, file, json_file

FOLDER = "results/experiments/paper"
IDENTIFIER = f"{FOLDER}/identifiers/weighted/network/seed_0/identifier.json"
METRICS = f"{FOLDER}/evaluation/metrics.json"
CONFIGURATION = f"{FOLDER}/configuration.yaml"
NAMES = {IDENTIFIER: "identifier.json", METRICS: "metrics.json", CONFIGURATION: "configuration.yaml"}


def _set(*keys: Any, to: Any) -> Callable[[Any], object]:
    """Set what stands at these keys."""

    def change(plain: Any) -> None:
        for key in keys[:-1]:
            plain = plain[key]
        plain[keys[-1]] = to

    return change


def _drop(*keys: Any) -> Callable[[Any], object]:
    def change(plain: Any) -> None:
        for key in keys[:-1]:
            plain = plain[key]
        del plain[keys[-1]]

    return change


#: what is wrong with the identifier -> how it is changed, and what is named
IDENTIFIERS: dict[str, tuple[Callable[[Any], object], str]] = {
    "R of -1": (_set("actuator", "resistance", to=-1.0), "actuator.resistance"),
    "R of NaN": (_set("actuator", "resistance", to=float("nan")), "identifier.json"),
    "R a word": (_set("actuator", "resistance", to="one"), "actuator.resistance"),
    "R missing": (_drop("actuator", "resistance"), "actuator.resistance"),
    "actuator of more": (_set("actuator", "mass", to=1.0), "actuator.mass"),
    "actuator null": (_set("actuator", to=None), "actuator"),
    "weight of NaN": (_set("network", "weights", 0, 0, 0, to=float("nan")), "identifier.json"),
    "weight infinite": (_set("network", "weights", 0, 0, 0, to=float("inf")), "identifier.json"),
    "weight null": (_set("network", "weights", 0, 0, 0, to=None), "network.weights"),
    "weight a word": (_set("network", "weights", 0, 0, 0, to="x"), "network.weights"),
    "weights ragged": (_set("network", "weights", 0, 0, to=[1.0]), "network.weights"),
    "weights of another shape": (_set("network", "weights", 0, to=[[1.0]]), "network.weights"),
    "a layer missing": (_drop("network", "weights", 0), "network.weights"),
    "no weights": (_set("network", "weights", to=[]), "network.weights"),
    "scale of zero": (_set("network", "scaler", "feature_scale", 0, to=0.0), "network.scaler.feature_scale"),
    "scaler short": (_set("network", "scaler", "fault_mean", to=[0.0]), "network.scaler.fault_mean"),
    "scaler missing": (_drop("network", "scaler", "fault_mean"), "fault_mean"),
    "unknown activation": (_set("network", "settings", "activation", to="magic"), "activation"),
    "another width": (_set("network", "settings", "width", to=200), "network"),
    "alpha a word": (_set("alpha_m", to="x"), "alpha_m"),
    "alpha null": (_set("alpha_m", to=None), "alpha_m"),
    "noise short": (_set("noise", to=[[1e-6]]), "noise"),
    "noise negative": (_set("noise", to=[[-1e-6 * (m == n) for m in range(6)] for n in range(6)]), "noise"),
    "lag of 1e300": (_set("lag", to=1e300), "lag"),
    "lag true": (_set("lag", to=True), "lag"),
    "scores negative": (_set("intervals", "scores", 0, 0, to=-1.0), "intervals.scores"),
    "scores unsorted": (_set("intervals", "scores", 0, 0, to=1e9), "intervals.scores"),
    "scores empty": (_set("intervals", "scores", to=[]), "intervals.scores"),
    "scores null": (_set("intervals", "scores", to=None), "intervals.scores"),
    "variance negative": (_set("intervals", "missed_variance", 0, to=-1.0), "intervals.missed_variance"),
    "variance short": (_set("intervals", "typical_variance", to=[0.0]), "intervals.typical_variance"),
    "intervals missing": (_drop("intervals"), "intervals"),
    "intervals a number": (_set("intervals", to=5), "intervals"),
    "range short": (_set("feature_low", to=[0.0]), "feature_low"),
    "range upside down": (_set("feature_low", 0, to=1e9), "feature_high"),
    "healthy negative": (_set("healthy", to=[-1.0] * 6), "healthy"),
    "healthy short": (_set("healthy", to=[1.0]), "healthy"),
    "another format": (_set("format", to=99), "format 99"),
    "format missing": (_drop("format"), "format"),
    "estimator unknown": (_set("estimator", to="magic"), "estimator"),
    "network missing": (_set("network", to=None), "network"),
    "a key too many": (_set("extra", to=1), "extra"),
}

RESULT = {"method": "weighted", "estimator": "network", "all": {"errors.mean.over_range": {"mean": 0.01}}}
#: what is wrong with the metrics -> how they are changed, and what is named
TABLES: dict[str, tuple[Callable[[Any], object], str]] = {
    "no results": (_drop("results"), "results"),
    "results empty": (_set("results", to=[]), "results"),
    "results null": (_set("results", to=None), "results"),
    "results a number": (_set("results", to=5), "results"),
    "result a word": (_set("results", 0, to="x"), "results"),
    "result without errors": (_drop("results", 0, "all"), "all"),
    "error null": (_set("results", 0, "all", "errors.mean.over_range", "mean", to=None), "errors.mean.over_range"),
    "error negative": (_set("results", 0, "all", "errors.mean.over_range", "mean", to=-1), "errors.mean.over_range"),
    "error of NaN": (_set("results", 0, "all", "errors.mean.over_range", "mean", to=float("nan")), "metrics.json"),
    "method a number": (_set("results", 0, "method", to=5), "method"),
}

#: what stands in a file instead
CONTENTS: dict[str, bytes] = {
    "empty": b"",
    "a brace": b"{",
    "null": b"null",
    "a list": b"[]",
    "a word": b'"x"',
    "not text": b"\xff\xfe\x00",
    "an empty mapping": b"{}",
}


def _halved(name: str) -> Prepare:
    def prepare(folder):
        whole = (folder / name).read_bytes()
        (folder / name).write_bytes(whole[: len(whole) // 2])

    return prepare


def _yaml(**changes: Any) -> Prepare:
    """The configuration with whole groups replaced."""

    def prepare(folder):
        from omegaconf import OmegaConf

        config = OmegaConf.load(folder / CONFIGURATION)
        for key, value in changes.items():
            if value is None:
                del config[key]
            else:
                OmegaConf.update(config, key.replace("__", "."), value, merge=False)
        OmegaConf.save(config, folder / CONFIGURATION)

    return prepare


CONFIGURATIONS: dict[str, tuple[Prepare, str]] = {
    "no actuator": (_yaml(actuator=None), "actuator"),
    "R of -1": (_yaml(actuator__resistance=-1), "actuator.resistance"),
    "actuator a number": (_yaml(actuator=5), "actuator"),
    "no sensors": (_yaml(sensors=None), "sensors"),
    "reconstruction a list": (_yaml(reconstruction=["a"]), "reconstruction"),
    "method unknown": (_yaml(reconstruction__weighted__method="magic"), "reconstruction.weighted.method"),
    "setting missing": (_yaml(reconstruction__weighted={"method": "weighted"}), "reconstruction.weighted.discard"),
    "ambient negative": (_yaml(sensors__ambient=-1), "sensors.ambient"),
    "missing value": (_yaml(sensors__ambient="???"), "sensors.ambient"),
}

LINE = "identify good.nc --experiment paper"


def _entries() -> dict[str, Entry]:
    found = {}
    for what, (change, says) in IDENTIFIERS.items():
        found[f"identifier, {what}"] = entry(LINE, "identifier.json", says, prepare=json_file(IDENTIFIER, change))
    for what, (change, says) in TABLES.items():
        found[f"metrics, {what}"] = entry(LINE, "metrics.json", says, prepare=json_file(METRICS, change))
    for what, (prepare, says) in CONFIGURATIONS.items():
        found[f"configuration, {what}"] = entry(LINE, "configuration.yaml", says, prepare=prepare)
    for path, name in NAMES.items():
        for what, content in CONTENTS.items():
            found[f"{name}, {what}"] = entry(LINE, name, prepare=file(path, content))
        found[f"{name}, half-written"] = entry(LINE, name, prepare=_halved(path))
    return found


ENTRIES = _entries()
