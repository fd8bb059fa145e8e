"""List the trials of the search and choose a network."""

from emafault.progress import one_line_errors
from emafault.study.networks import choose_network

with one_line_errors(snakemake.log[0]):
    out = snakemake.output
    choose_network(list(snakemake.input), snakemake.params.spec, out.trials, out.chosen)
