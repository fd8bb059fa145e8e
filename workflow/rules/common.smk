# What every rule needs: the composed configuration, where files stand and what digests trigger a rule again.
import os
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")

from snakemake.exceptions import WorkflowError

from emafault import config as configuration
from emafault.errors import InputError

RESULTS = "results"
SCRIPTS = workflow.basedir + "/workflow/scripts"

try:
    PLAN = configuration.plan(
        config.get("experiment", "paper"), config.get("overrides", "")
    )
except InputError as error:
    sys.exit(f"emafault: {error}")

EXPERIMENT = f"{RESULTS}/experiments/{PLAN.name}"
DATASETS = sorted({name for case in PLAN.cases for name in case.datasets.values()})
WORKERS = max(case.config["search"]["workers"] for case in PLAN.cases)


wildcard_constraints:
    case="|".join(case.path for case in PLAN.cases),
    dataset="|".join(DATASETS),
    part="|".join(configuration.PARTS),
    shard=r"\d+",
    method="|".join(
        sorted({name for case in PLAN.cases for name in case.config["reconstruction"]})
    ),
    estimator="closed_form|network|searched",
    worker=r"\d+",


def code(script):
    """Digest of a rule's script and of everything of the package that it imports."""
    return configuration.source_digest(f"{SCRIPTS}/{script}.py")


def case_of(wildcards):
    return PLAN.case(wildcards.case)


def case_files(name):
    """One file of every case."""
    return [f"{RESULTS}/experiments/{case.path}/{name}" for case in PLAN.cases]


def shards(case, part):
    """The files of one part of a case's dataset."""
    number = case.config["sampling"]["shards"]
    return [
        f"{RESULTS}/datasets/{case.datasets[part]}/{part}/shard_{shard}.nc"
        for shard in range(number)
    ]


def all_features(case):
    """Every table of features of a case."""
    folder = f"{RESULTS}/experiments/{case.path}/features"
    return [
        f"{folder}/{part}_{method}.nc"
        for part in case.parts
        for method in case.config["reconstruction"]
    ]


def estimators(case, method):
    """The estimators trained on one method's features."""
    search = case.config["search"]
    searched = search["trials"] > 0 and search["reconstruction"] == method
    return ["closed_form", "network", *(["searched"] if searched else [])]
