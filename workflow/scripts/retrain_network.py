"""Train a network without and with the effects that a diagnosis named."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.retrain import retrain_network

with one_line_errors(snakemake.log[0]):
    params = snakemake.params
    retrain_network(params.bench, Path(snakemake.input.verdict).parent, params.spec, snakemake.output[0])
