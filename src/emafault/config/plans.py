"""Everything one call of the workflow composes: the cases of an experiment or study, with their datasets."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import InputError, shown
from .composition import compose, composed, experiments, split_overrides
from .draws import check_draws
from .separate import design, evidence
from .stages import PARTS, dataset_spec

SHARDS_OF_A_BLOCK = 5  # that one job reconstructs, some 20 s of work


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
    evidence()
    design()
    texts = split_overrides(overrides)
    top = compose(experiment, texts)
    if top["variants"]:
        configs = {f"{top['name']}/{v}": composed(experiment, [*texts, *more]) for v, more in top["variants"].items()}
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
