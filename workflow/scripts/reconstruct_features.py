"""Reconstruct the runs of a part, or of a block of its shards, by one method; or join its blocks."""

from emafault.progress import one_line_errors
from emafault.study.features import join_features, reconstruct_features

with one_line_errors(snakemake.log[0]):
    params = snakemake.params
    if params.get("joined"):
        join_features(list(snakemake.input), snakemake.output[0])
    else:
        reconstruct_features(list(snakemake.input), params.spec, snakemake.output[0])
