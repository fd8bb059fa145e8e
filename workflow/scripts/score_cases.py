"""Score the cases of a draw."""

from pathlib import Path

from emafault.progress import one_line_errors
from emafault.study.scored import score_draw

with one_line_errors(snakemake.log[0]):
    files = [Path(path) for path in snakemake.input.batches]
    given, out = snakemake.input, snakemake.output
    places = Path(given.measured) if given.measured else None, Path(out.report), Path(out.scores)
    score_draw(files, *places, given.where[0], snakemake.threads)
