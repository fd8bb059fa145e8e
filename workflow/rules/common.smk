# What all of them share: the composed configuration, where files stand, what each stage reads and its sources' digests.
# Functions of wildcards stand here, in the order of the pipeline; the files beside this one hold only steps.
import os
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")

from emafault import config as configuration
from emafault import provenance
from emafault.errors import InputError, one_line
from emafault.places import refuse_folder
from emafault.reporting import failures, times

RESULTS = "results"
# where results are in the end; with a storage provider they are in the working folder only while they are used
stored = workflow.storage_settings
KEPT = (
    os.path.join(stored.default_storage_prefix or "", RESULTS) if stored.default_storage_provider == "fs" else RESULTS
)

try:
    if workflow.remote_exec:
        failures.refuse_restart(os.environ)
    configuration.check_call(config)
    PLAN = configuration.plan(config.get("experiment", "paper"), config.get("overrides", ""))
    refuse_folder(KEPT)
    for case in PLAN.cases:
        configuration.command_files(case.config)
except InputError as error:
    sys.exit(f"emafault: {one_line(error)}")

EXPERIMENT = f"{RESULTS}/experiments/{PLAN.name}"
CASE = f"{RESULTS}/experiments/{{case}}"


wildcard_constraints:
    case="|".join(case.path for case in PLAN.cases),
    dataset="|".join(sorted({name for case in PLAN.cases for name in case.datasets.values()})),
    part="|".join(configuration.PARTS),
    method="|".join(sorted({name for case in PLAN.cases for name in case.config["reconstruction"]})),
    estimator="closed_form|network|searched",
    shard=r"\d+",
    worker=r"\d+",
    block=r"\d+",
    seed=r"\d+",


def code(script):
    """Digest of a script and of everything of the package that it imports."""
    return provenance.source_digest(f"{workflow.basedir}/workflow/scripts/{script}.py")


def composed(wildcards):
    """Configuration of a case."""
    return PLAN.case(wildcards.case).config


def case_files(name):
    """One file of every case."""
    return [f"{RESULTS}/experiments/{case.path}/{name}" for case in PLAN.cases]


def more(first):
    """Megabytes or minutes of a job, doubled with every attempt after one that it took too much of."""
    return lambda wildcards, attempt: first * 2 ** (attempt - 1)


onstart:
    try:
        provenance.claim(KEPT)
    except InputError as error:
        sys.exit(f"emafault: {one_line(error)}")


onsuccess:
    times.write(f"{KEPT}/benchmarks")


onerror:
    times.write(f"{KEPT}/benchmarks")
    for line in failures.lines(workflow.scheduler.failed, failures.logged(log)):
        print(line, file=sys.stderr, flush=True)


# --- datasets and features ---


def dataset_spec(wildcards):
    return PLAN.dataset(wildcards.dataset, wildcards.part)


def command_of_dataset(wildcards):
    """The file that a command is read from, if it is given as one; no storage provider is asked for it."""
    return [local(path) for path in configuration.command_files(dataset_spec(wildcards))]


def command_of_case(wildcards):
    return [local(path) for path in configuration.command_files(composed(wildcards))]


def shards(case, part):
    """The files of one part of a case's dataset."""
    number = configuration.dataset_spec(case.config, part)["shards"]
    return [f"{RESULTS}/datasets/{case.datasets[part]}/{part}/shard_{shard}.nc" for shard in range(number)]


def shards_of_part(wildcards):
    return shards(PLAN.case(wildcards.case), wildcards.part)


def in_blocks(files):
    """The shards of a part in the blocks that jobs reconstruct, if there is more than one."""
    size = configuration.SHARDS_OF_A_BLOCK
    return [files[n : n + size] for n in range(0, len(files), size)] if len(files) > size else []


def blocks_of_part(wildcards):
    return in_blocks(shards_of_part(wildcards))


def shards_of_block(wildcards):
    return blocks_of_part(wildcards)[int(wildcards.block)]


def reconstructed_from(wildcards):
    """The shards themselves, or what other jobs have reconstructed from blocks of them."""
    stem = f"{RESULTS}/experiments/{wildcards.case}/features/{wildcards.part}_{wildcards.method}"
    return [f"{stem}.{n}.nc" for n in range(len(blocks_of_part(wildcards)))] or shards_of_part(wildcards)


def feature_tables(case, part):
    """The tables of features of one part of a case, by every method."""
    folder = f"{RESULTS}/experiments/{case.path}/features"
    return [f"{folder}/{part}_{method}.nc" for method in case.config["reconstruction"] if part in case.parts]


def reconstruction_spec(wildcards):
    return configuration.reconstruction_spec(composed(wildcards), wildcards.method)


def bound_spec(wildcards):
    return configuration.bound_spec(composed(wildcards))


# --- identification ---


def training_features(wildcards):
    """Features that are trained on: of the method asked for, else of the one that is searched on."""
    method = wildcards.get("method", composed(wildcards)["search"]["reconstruction"])
    return f"{RESULTS}/experiments/{wildcards.case}/features/training_{method}.nc"


def training_spec(wildcards):
    return configuration.network_spec(composed(wildcards), wildcards.estimator)


def seed_spec(wildcards):
    """What training one seed reads, which is not how many there are."""
    return {key: value for key, value in training_spec(wildcards).items() if key != "seeds"}


def trained_from(wildcards):
    """What an estimator is trained from, or, of runs that several jobs have reconstructed, what is trained by seed."""
    seeds = training_spec(wildcards).get("seeds", 1)
    if seeds > 1 and in_blocks(shards(PLAN.case(wildcards.case), "training")):
        folder = f"{RESULTS}/experiments/{wildcards.case}/identifiers/{wildcards.method}"
        return {"trained": [f"{folder}/{wildcards.estimator}.{seed}" for seed in range(seeds)]}
    return {"features": training_features(wildcards), "chosen": chosen_network(wildcards)}


def search_spec(wildcards):
    return configuration.search_spec(composed(wildcards))


def search_storage(wildcards):
    own = f"{RESULTS}/experiments/{wildcards.case}/search/journal.log"
    return composed(wildcards)["search"]["storage"] or own


def searching_workers(wildcards):
    number = composed(wildcards)["search"]["workers"]
    return [f"{RESULTS}/experiments/{wildcards.case}/search/worker_{worker}.json" for worker in range(number)]


def search_results(wildcards):
    names = ("trials", "chosen") if composed(wildcards)["search"]["trials"] else ()
    return [f"{RESULTS}/experiments/{wildcards.case}/search/{name}.json" for name in names]


def chosen_network(wildcards):
    """What the search found, for the estimator that is trained from it."""
    return search_results(wildcards)[1:] if wildcards.estimator == "searched" else []


def estimators(wildcards):
    """The folder of every trained estimator of a case."""
    search = composed(wildcards)["search"]
    searched = search["reconstruction"] if search["trials"] else None
    names = [
        f"{method}/{estimator}"
        for method in composed(wildcards)["reconstruction"]
        for estimator in (
            "closed_form",
            "network",
            *(["searched"] if method == searched else []),
        )
    ]
    owner = PLAN.case(wildcards.case).learnt
    return [f"{RESULTS}/experiments/{owner}/identifiers/{name}" for name in names]


def exported_network(wildcards):
    """The network worth embedding: the searched one, else that of the features searched on, else of the last method."""
    networks = [path for path in estimators(wildcards) if "closed_form" not in path]
    own = os.path.join("identifiers", composed(wildcards)["search"]["reconstruction"], "")
    others = [path for path in networks if "identifiers/paper" not in path]
    return ([path for path in networks if own in path] or others or networks)[-1:]


def exported_features(wildcards):
    """Fresh features of the method that the exported network reads."""
    method = exported_network(wildcards)[0].split("identifiers/")[1].split(os.sep)[0]
    return f"{RESULTS}/experiments/{wildcards.case}/features/fresh_{method}.nc"


def evaluation_spec(wildcards):
    return configuration.evaluation_spec(composed(wildcards))


def fresh_features(wildcards):
    return feature_tables(PLAN.case(wildcards.case), "fresh")


def reference_features(wildcards):
    return feature_tables(PLAN.case(wildcards.case), "reference")


# --- report ---


def examples_spec(wildcards):
    return configuration.examples_spec(composed(wildcards))


def whole_configuration(wildcards):
    return configuration.recursively_sorted(composed(wildcards))


def title_and_question(wildcards):
    return {"title": wildcards.case, "question": composed(wildcards)["question"]}


def data_of_case(wildcards):
    """What MLflow is told of the data sets of a case; equal digests are of equal numbers."""
    case, simulated = PLAN.case(wildcards.case), code("simulate_shard")
    datasets = {"training": PLAN.case(case.learnt).datasets["training"], **case.datasets}
    return [
        {
            "name": f"{name}/{part}",
            "digest": provenance.digest_of(PLAN.dataset(name, part), simulated),
            "source": f"{RESULTS}/datasets/{name}/{part}",
            "context": {"training": "training", "fresh": "evaluation", "reference": "calibration"}[part],
            "rows": PLAN.dataset(name, part)["runs"],
        }
        for part, name in datasets.items()
    ]


# --- benches and blind cases ---

BENCH = str(config.get("bench", "")).rstrip("/")
TWIN = str(config.get("twin", "actuator"))
DIAGNOSIS = f"{RESULTS}/diagnoses/{configuration.bench_name(BENCH)}"
# only what was named of the actuator can be handed to the next experiment
DIAGNOSED = {"experiment": f"{DIAGNOSIS}/experiment.yaml"} if TWIN == "actuator" else {}
WITHHELD = f"{RESULTS}/withheld"
CALIBRATED = configuration.actuator_name(config.get("overrides", ""))[0]
CALIBRATION = f"{RESULTS}/calibration/{CALIBRATED}"
BENCHES = str(config.get("benches", "")).rstrip("/")
FLEET_NAME = configuration.bench_name(BENCHES)
FLEET = f"{RESULTS}/fleets/{FLEET_NAME}"


def bench_files(wildcards):
    """The files of the bench, where they are: no storage provider is asked for them."""
    try:
        return [local(path) for path in configuration.bench_files(BENCH)]
    except InputError as error:
        sys.exit(f"emafault: {one_line(error)}")


def batch_files(wildcards):
    """The files of a batch of a fleet."""
    return [local(path) for path in configuration.batch_files(configuration.batches(BENCHES)[int(wildcards.batch)])]


def fleet_batches(wildcards):
    """One file of every batch of a fleet."""
    try:
        number = len(configuration.batches(BENCHES))
    except InputError as error:
        sys.exit(f"emafault: {one_line(error)}")
    return [f"{FLEET}/batch_{n}.parquet" for n in range(number)]


def calibration_spec(wildcards):
    return configuration.calibration_spec(PLAN.cases[0].config, config.get("overrides", ""))


def code_of_calibration(wildcards):
    """Digest of what the cases of an actuator depend on, which names their folder."""
    return provenance.digest_of(calibration_spec(wildcards), code("diagnose_cases"))


def calibration_batches(wildcards):
    """Files of every job of an actuator's cases."""
    return [f"{CALIBRATION}/{rung}_{n}.json" for rung, n in configuration.withheld_jobs("own")]


def withheld_measured(wildcards):
    """Rows of the measured recordings, of a draw that shows them."""
    return rules.diagnose_machines.output.withheld if configuration.withheld_shows_measured(wildcards.draw) else []


def withheld_batches(wildcards):
    """Files of every job of a draw."""
    return [f"{WITHHELD}/{wildcards.draw}/{rung}_{n}.json" for rung, n in configuration.withheld_jobs(wildcards.draw)]
