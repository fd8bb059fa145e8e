"""Train one estimator on one method's features."""

from emafault.progress import one_line_errors
from emafault.study.networks import HISTORY, train_identifier

with one_line_errors(snakemake.log[0]):
    chosen = snakemake.input.chosen[0] if snakemake.input.chosen else None
    history = f"{snakemake.output[0]}/{HISTORY}"
    train_identifier(snakemake.wildcards.estimator, snakemake.input.features, snakemake.params.spec, history, chosen)
