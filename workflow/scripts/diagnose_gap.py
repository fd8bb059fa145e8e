"""Diagnose a bench."""

from pathlib import Path

from emafault.equations.run import diagnose_folder
from emafault.machines.run import diagnose_file
from emafault.progress import one_line_errors

with one_line_errors(snakemake.log[0]):
    params = snakemake.params
    out = Path(snakemake.output.verdict).parent
    if params.twin == "actuator":
        diagnose_folder(params.bench, params.spec, out)
    else:
        diagnose_file(params.bench, params.twin, params.spec, out)
