"""Stated against achieved probability on an actuator's blind cases."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.calibration import finish

with one_line_errors(snakemake.log[0]):
    given, out = snakemake.input, snakemake.output
    batches = [Path(path) for path in given.batches]
    finish(batches, Path(given.pace[0]), Path(out.page), Path(out.found), snakemake.params.spec)
