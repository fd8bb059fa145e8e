"""Diagnose one batch of a fleet."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.fleet import diagnose_batch

with one_line_errors(snakemake.log[0]):
    params = snakemake.params
    benches = list(dict.fromkeys(str(Path(file).parent) for file in snakemake.input.files))
    output = Path(snakemake.output[0])
    diagnose_batch(benches, params.spec, output.parent / f"rows_{params.code[:8]}{params.kept}", output)
