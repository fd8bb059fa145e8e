"""Train a network without and with the effects that a diagnosis named."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.retrain import retrain_network

with one_line_errors(snakemake.log[0]):
    given, params, out = snakemake.input, snakemake.params, snakemake.output
    bench = Path(given.files[0])
    bench = bench.parent if params.is_folder else bench
    retrain_network(bench, given.verdict, given.report, params.spec, out.result, out.report)
