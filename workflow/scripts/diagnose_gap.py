"""Diagnose a bench."""

from pathlib import Path

from emafault.gap.run import diagnose_path
from emafault.progress import one_line_errors

with one_line_errors(snakemake.log[0]):
    params = snakemake.params
    diagnose_path(params.bench, params.spec, out=Path(snakemake.output.verdict).parent, twin=params.twin)
