"""Fit the curves of probability to the development cases."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.blind import calibrate_draw

with one_line_errors(snakemake.log[0]):
    calibrate_draw([Path(path) for path in snakemake.input], Path(snakemake.output[0]))
