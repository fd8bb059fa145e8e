"""Export a trained network to ONNX and to C99."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.networks import export_network

with one_line_errors(snakemake.log[0]):
    folder = Path(snakemake.input.network[0])
    out = snakemake.output
    export_network(folder, snakemake.input.features, out.model, out.calibrated, out.source, out.check)
