"""Search the command and load that identify best in a recording of one length."""

from emafault.progress import one_line_errors
from emafault.study.optimal_command import search_command

with one_line_errors(snakemake.log[0]):
    search_command(snakemake.params.spec, snakemake.params.length, snakemake.output[0])
