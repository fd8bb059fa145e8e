"""List the trials of the search and choose a network."""

from emafault.progress import one_line_errors
from emafault.study.networks import choose_network

with one_line_errors(snakemake.log[0]):
    out, params = snakemake.output, snakemake.params
    choose_network(snakemake.input.features, params.spec, params.storage, out.trials, out.chosen)
