"""Train a network without and with the effects that a diagnosis named."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.retrain import retrain_network

with one_line_errors(snakemake.log[0]):
    params = snakemake.params
    bench = Path(snakemake.input.files[0])
    bench = bench.parent if params.is_folder else bench
    retrain_network(str(bench), Path(snakemake.input.verdict).parent, params.spec, snakemake.output[0])
