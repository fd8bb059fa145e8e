# One fault from several recordings of a unit, by six and by nine features.
#
#   snakemake --cores all several_recordings


rule identify_several:
    input:
        rules.compile_simulation.output,
    output:
        f"{RESULTS}/several_recordings/errors.json",
    log:
        f"{RESULTS}/logs/several_recordings/identify_several.log",
    benchmark:
        f"{RESULTS}/benchmarks/several_recordings/identify_several.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(30),
    params:
        spec=lambda wildcards: configuration.several_spec(),
        code=code("identify_several"),
    script:
        "../scripts/identify_several.py"


rule draw_several:
    input:
        rules.identify_several.output,
    output:
        report=f"{RESULTS}/several_recordings/report.html",
        figures=directory(f"{RESULTS}/several_recordings/figures"),
    log:
        f"{RESULTS}/logs/several_recordings/draw_several.log",
    benchmark:
        f"{RESULTS}/benchmarks/several_recordings/draw_several.tsv"
    resources:
        mem_mb=more(1000),
        runtime=more(10),
    params:
        spec=lambda wildcards: configuration.several_spec(),
        code=code("draw_several"),
    script:
        "../scripts/draw_several.py"


rule several_recordings:
    """Identify one fault from several recordings of a unit."""
    input:
        rules.draw_several.output.report,
