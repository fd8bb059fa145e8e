"""Draw errors and bounds over the number of recordings of one fault."""

from emafault.progress import one_line_errors
from emafault.study.several import draw_several

with one_line_errors(snakemake.log[0]):
    draw_several(snakemake.params.spec, snakemake.input[0], snakemake.output.report, snakemake.output.figures)
