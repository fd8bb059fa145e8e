"""Calibrate the probabilities of measured machines."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.calibrate_measured import calibrate_measured

with one_line_errors(snakemake.log[0]):
    out, given = snakemake.output, snakemake.params
    calibrate_measured(Path(snakemake.input.sets), Path(out.calibrations), Path(out.check), given.draws, given.seed)
