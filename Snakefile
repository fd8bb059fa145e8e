# The study, end to end. This file is the table of contents: the rules stand in workflow/rules in the order of the
# pipeline, the targets at the end. Configuration is composed once, in common.smk; each rule is handed what it reads.
#
#   snakemake --cores all                                          the paper's study
#   snakemake --cores all --config experiment=magnet_smco          another experiment of conf/experiment
#   snakemake --cores all --config experiment=magnet_smco "overrides=command=sine faults.dT.high=90"
from snakemake.utils import min_version

min_version("9.0")


include: "workflow/rules/common.smk"
include: "workflow/rules/dataset.smk"
include: "workflow/rules/reconstruction.smk"
include: "workflow/rules/identification.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/measured.smk"
include: "workflow/rules/gap.smk"
include: "workflow/rules/fleet.smk"
include: "workflow/rules/withheld.smk"
include: "workflow/rules/calibration.smk"
include: "workflow/rules/evidence.smk"
include: "workflow/rules/optimal_command.smk"
include: "workflow/rules/several_recordings.smk"


provenance.keep_known_sources()


# The default target: everything that one experiment, or one study with its variants, results in.
rule study:
    default_target: True
    input:
        f"{EXPERIMENT}/report.html",
        case_files("report.html"),
        case_files("tracked.json"),
        [path for case in PLAN.cases for part in case.parts for path in feature_tables(case, part)],


rule datasets:
    """Only simulate."""
    input:
        [path for case in PLAN.cases for part in case.parts for path in shards(case, part)],


rule features:
    """Simulate and reconstruct."""
    input:
        [path for case in PLAN.cases for part in case.parts for path in feature_tables(case, part)],
