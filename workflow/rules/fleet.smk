# A fleet: every folder of recordings in a folder diagnosed, in batches; one table, one page.
#
#   snakemake --cores all fleet --config benches=DIR


rule diagnose_batch:
    input:
        files=batch_files,
        compiled=rules.compile_simulation.output,
    output:
        f"{FLEET}/batch_{{batch}}.parquet",
    log:
        f"{RESULTS}/logs/fleets/{FLEET_NAME}/diagnose_batch_{{batch}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/fleets/{FLEET_NAME}/diagnose_batch_{{batch}}.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(60),
    params:
        spec=configuration.diagnosis_spec(PLAN.cases[0].config),
        kept=configuration.fleet_digest(PLAN.cases[0].config),
        code=code("diagnose_batch"),
    script:
        "../scripts/diagnose_batch.py"


rule show_fleet:
    input:
        batches=fleet_batches,
    output:
        table=f"{FLEET}/fleet.parquet",
        report=f"{FLEET}/report.html",
    log:
        f"{RESULTS}/logs/fleets/{FLEET_NAME}/show_fleet.log",
    benchmark:
        f"{RESULTS}/benchmarks/fleets/{FLEET_NAME}/show_fleet.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(10),
    params:
        name=FLEET_NAME,
        code=code("show_fleet"),
    script:
        "../scripts/show_fleet.py"


rule fleet:
    """Diagnose every bench of a folder."""
    input:
        rules.show_fleet.output,
