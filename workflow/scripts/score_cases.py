"""Score the cases of a draw."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.scored import score_draw

with one_line_errors(snakemake.log[0]):
    files = [Path(path) for path in snakemake.input.batches]
    score_draw(files, Path(snakemake.output.report), Path(snakemake.output.scores), snakemake.input.where[0])
