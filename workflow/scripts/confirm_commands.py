"""Simulate the commands that were found and identify the faults of fresh runs."""

from emafault.progress import one_line_errors
from emafault.study.confirmed_command import confirm_commands

with one_line_errors(snakemake.log[0]):
    confirm_commands(snakemake.params.spec, list(snakemake.input), snakemake.output[0])
