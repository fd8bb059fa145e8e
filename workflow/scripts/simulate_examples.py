"""Simulate the recordings that the paper's figures show."""

from emafault.progress import one_line_errors
from emafault.study.examples import simulate_examples

with one_line_errors(snakemake.log[0]):
    simulate_examples(snakemake.params.spec, snakemake.output[0])
