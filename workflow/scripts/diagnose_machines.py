"""Diagnose every measured set into one page."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.machines import diagnose_machines

with one_line_errors(snakemake.log[0]):
    given, out = snakemake.input, snakemake.output
    diagnose_machines(
        Path(given.sets),
        Path(given.nameplate),
        Path(out.report),
        Path(out.figures),
        Path(out.verdicts),
        Path(out.withheld),
    )
