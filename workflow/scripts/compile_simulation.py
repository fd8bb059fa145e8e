"""Compile the simulation once, so that the jobs that follow find it in the cache."""

from emafault.dataset import compile_simulation
from emafault.progress import one_line_errors

with one_line_errors(snakemake.log[0]):
    compile_simulation(snakemake.params.spec, snakemake.output[0])
