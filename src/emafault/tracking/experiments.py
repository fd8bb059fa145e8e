"""The experiments that runs are logged to: what each is for, and the columns that its runs are compared by."""

import json
from dataclasses import dataclass

VIEW = "headline"


def pages(experiment_id: str) -> str:
    """The part of an address that opens an experiment in the view of model training with its columns."""
    return f"#/experiments/{experiment_id}/runs?viewStateShareKey={VIEW}&workflowType=machine_learning"


@dataclass(frozen=True)
class Experiment:
    """An MLflow experiment: what its name ends in, what it holds and which columns are shown."""

    ending: str
    holds: str
    metrics: tuple[str, ...]  # the first is the one that charts begin with
    parameters: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()  # tags

    def named(self, name: str) -> str:
        """Its name, given the one that the configuration gives."""
        return f"{name}{self.ending}"

    def tags(self, experiment_id: str) -> dict[str, str]:
        """What MLflow's pages read: without a kind they take an experiment for one of language models and show none."""
        keys = (("metrics", self.metrics), ("params", self.parameters), ("tags", self.labels))
        columns = [f"{kind}.`{name}`" for kind, names in keys for name in names]
        columns += ["attributes.`Dataset`", "attributes.`Models`"]
        view = {"selectedColumns": columns, "columnOrder": columns}
        return {
            "mlflow.experimentKind": "custom_model_development",
            "mlflow.experiment.primaryMetric.name": self.metrics[0],
            "mlflow.note.content": f"{self.holds}\n\n[Runs with the columns that one compares]({pages(experiment_id)})",
            f"mlflow.sharedViewState.{VIEW}": json.dumps(view),
        }


STUDIES = Experiment(
    "",
    "Evaluated experiments, a run each; the trials of its search are nested below. Errors are mean absolute ones on "
    "fresh runs, dT in K, N and xi in %; `bound` is the same at the Cramér-Rao bound, `paper` the paper's method, "
    "`network` the exported network.",
    (
        "error_dT_K",
        "error_N_pct",
        "error_xi_pct",
        "coverage",
        "bound_dT_K",
        "bound_N_pct",
        "bound_xi_pct",
        "paper_dT_K",
    ),
    ("magnet.coefficient", "command.name", "sampling.runs"),
    ("best",),
)
DIAGNOSES = Experiment(
    "-diagnoses",
    "Diagnoses of benches, a run each: what was named with which probability, and how far it closes the misfit of the "
    "recordings set aside, in multiples of its noise.",
    ("probability", "signal.closed", "signal.recalibrated", "signal.after"),
    ("verdict", "effects", "twin"),
)
BLIND_CASES = Experiment(
    "-blind-cases",
    "Scoreboards of draws of blind cases, a run each.",
    ("right_t1", "right_t4", "wrong_t0", "named_t7", "loss_t7", "same_t9", "false_share", "coverage"),
    ("draw", "cases"),
)
