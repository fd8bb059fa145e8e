"""Diagnose a bench."""

from pathlib import Path

from emafault.equations.run import diagnose_folder
from emafault.machines.run import diagnose_file
from emafault.progress import one_line_errors

with one_line_errors(snakemake.log[0]):
    params = snakemake.params
    out = Path(snakemake.output.verdict).parent
    bench = Path(snakemake.input.files[0])
    bench = bench.parent if params.is_folder else bench
    if params.twin == "actuator":
        diagnose_folder(bench, params.spec, out, calibration=snakemake.input.get("calibration") or None)
    else:
        diagnose_file(bench, params.twin, params.spec, out)
