"""Identify units from several recordings each."""

from emafault.progress import one_line_errors
from emafault.study.several import identify_several

with one_line_errors(snakemake.log[0]):
    identify_several(snakemake.params.spec, snakemake.output[0])
