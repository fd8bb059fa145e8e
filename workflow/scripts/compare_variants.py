"""Compare the variants of a study."""

from emafault.progress import one_line_errors
from emafault.study.report import compare_variants

with one_line_errors(snakemake.log[0]):
    spec, out = snakemake.params.spec, snakemake.output
    compare_variants(
        spec["title"],
        spec["question"],
        spec["variants"],
        list(snakemake.input),
        out.report,
        out.figures,
        spec["learnt_from"],
    )
