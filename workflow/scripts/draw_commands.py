"""Draw the page of the commands that were searched and confirmed."""

from emafault.progress import one_line_errors
from emafault.study.confirmed_command import draw_commands

with one_line_errors(snakemake.log[0]):
    into, out = snakemake.input, snakemake.output
    draw_commands(snakemake.params.spec, list(into.searched), str(into.confirmed), out.report, out.figures)
