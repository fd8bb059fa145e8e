"""Draw the report of one experiment."""

from emafault.progress import one_line_errors
from emafault.study.networks import histories_in
from emafault.study.report import draw_report

with one_line_errors(snakemake.log[0]):
    given, spec = snakemake.input, snakemake.params.spec
    draw_report(
        spec["title"],
        spec["question"],
        given.metrics,
        given.estimates,
        histories_in(given.estimators),
        given.examples[0],
        given.search,
        given.configuration[0],
        snakemake.output.report,
        snakemake.output.figures,
    )
