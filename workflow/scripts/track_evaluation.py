"""Log one evaluation with its search."""

from emafault.progress import one_line_errors
from emafault.study.networks import histories_in
from emafault.study.tracked import track_evaluation

with one_line_errors(snakemake.log[0]):
    given = snakemake.input
    files = {
        given.model: "model",
        given.calibrated: "model",
        given.source: "model",
        given.report: "",
        given.figures: "figures",
        given.configuration[0]: "",
    }
    track_evaluation(
        snakemake.wildcards.case,
        snakemake.params.spec,
        given.where[0],
        given.metrics,
        histories_in(given.estimators),
        given.search,
        files,
        (given.model, given.exported[0]),
        snakemake.params.data,
        snakemake.output[0],
    )
