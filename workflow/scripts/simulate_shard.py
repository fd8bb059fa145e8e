"""Simulate one shard of a dataset."""

from emafault.dataset import simulate_shard
from emafault.progress import one_line_errors

with one_line_errors(snakemake.log[0]):
    simulate_shard(snakemake.output[0], snakemake.params.spec, int(snakemake.wildcards.shard))
