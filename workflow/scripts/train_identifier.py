"""Train one estimator on one method's features, or one seed of it; or join what was trained seed by seed."""

from emafault.progress import one_line_errors
from emafault.study.networks import HISTORY, join_seeds, train_identifier

with one_line_errors(snakemake.log[0]):
    given = snakemake.input
    history = f"{snakemake.output[0]}/{HISTORY}"
    if given.get("trained"):
        join_seeds(list(given.trained), history)
    else:
        chosen = given.chosen[0] if given.chosen else None
        seed = snakemake.wildcards.get("seed")
        estimator, spec = snakemake.wildcards.estimator, snakemake.params.spec
        train_identifier(estimator, given.features, spec, history, chosen, None if seed is None else int(seed))
