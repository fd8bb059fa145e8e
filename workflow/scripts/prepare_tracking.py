"""Create the tracking database and its experiment once."""

from emafault.progress import one_line_errors
from emafault.study.tracked import prepare_tracking

with one_line_errors(snakemake.log[0]):
    prepare_tracking(snakemake.params.spec, snakemake.output[0])
