"""Make and diagnose one batch of blind cases."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.blind import run_batch

with one_line_errors(snakemake.log[0]):
    run_batch(Path(snakemake.output[0]), snakemake.params.spec, snakemake.params.code)
