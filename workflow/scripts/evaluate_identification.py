"""Evaluate every estimator on fresh runs."""

from emafault.progress import one_line_errors
from emafault.study.evaluation import evaluate_identification
from emafault.study.networks import histories_in

with one_line_errors(snakemake.log[0]):
    given, out = snakemake.input, snakemake.output
    evaluate_identification(
        histories_in(given.estimators),
        given.fresh,
        given.references,
        given.bound[0],
        snakemake.params.spec,
        out.metrics,
        out.estimates,
    )
