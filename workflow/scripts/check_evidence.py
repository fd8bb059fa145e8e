"""Check the evidence by draws from its own priors."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.evidence_check import check_evidence

with one_line_errors(snakemake.log[0]):
    out = snakemake.output
    check_evidence(snakemake.params.spec, Path(out.report), Path(out.figures), Path(out.scores))
