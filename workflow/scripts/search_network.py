"""Run one worker of the network search."""

from emafault.progress import one_line_errors
from emafault.study.networks import search_network

with one_line_errors(snakemake.log[0]):
    worker = int(snakemake.wildcards.worker)
    search_network(snakemake.input[0], snakemake.params.spec, snakemake.params.storage, worker, snakemake.output[0])
