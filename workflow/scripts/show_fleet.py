"""Join the batches of a fleet to one table, and draw its page."""

from emafault.progress import one_line_errors
from emafault.study.fleet import join_batches, read_table
from emafault.study.fleet_page import write_page

with one_line_errors(snakemake.log[0]):
    out = snakemake.output
    join_batches(snakemake.input.batches, out.table)
    write_page(read_table(out.table), snakemake.params.name, out.report)
