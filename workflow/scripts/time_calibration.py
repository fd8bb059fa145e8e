"""Say how long the check of the probabilities takes on an actuator."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.calibration import begin

with one_line_errors(snakemake.log[0]):
    begin(Path(snakemake.output[0]), snakemake.params.spec, snakemake.params.cases)
