"""Compute the Cramer-Rao bound of the fresh runs' faults."""

from emafault.progress import one_line_errors
from emafault.study.bound import compute_bound

with one_line_errors(snakemake.log[0]):
    compute_bound(snakemake.params.spec, snakemake.output[0])
