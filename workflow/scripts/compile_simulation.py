"""Compile the simulation and the reconstructions once, so that jobs that follow find them in the cache."""

from emafault.progress import one_line_errors
from emafault.study.features import compile_everything

with one_line_errors():
    compile_everything(snakemake.params.spec, snakemake.output[0])
