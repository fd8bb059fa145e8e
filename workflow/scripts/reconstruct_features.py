"""Reconstruct every run of a part of a dataset by one method."""

from emafault.progress import one_line_errors
from emafault.study.features import reconstruct_features

with one_line_errors(snakemake.log[0]):
    reconstruct_features(list(snakemake.input), snakemake.params.spec, snakemake.output[0])
