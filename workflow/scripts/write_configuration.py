"""Write the resolved configuration beside the results."""

from emafault.progress import one_line_errors
from emafault.study.networks import write_yaml

with one_line_errors(snakemake.log[0]):
    write_yaml(snakemake.output[0], snakemake.params.spec)
