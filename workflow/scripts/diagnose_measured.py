"""Diagnose every measured set into one page."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.measured import diagnose_sets

with one_line_errors(snakemake.log[0]):
    out = snakemake.output
    diagnose_sets(
        Path(snakemake.input.sets), Path(out.report), Path(out.figures), Path(out.verdicts), Path(out.withheld)
    )
