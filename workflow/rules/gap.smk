# Where a bench and the simulator disagree, which effect causes it, how far it explains it; networks retrained with it.
#
#   snakemake --cores all diagnose --config bench=PATH                 a bench of the reference actuator
#   snakemake --cores all diagnose --config bench=PATH twin=NAME       a measured machine
#   snakemake --cores all retrain --config bench=PATH                  what the named effect does for the network


rule diagnose_gap:
    input:
        files=bench_files,
        calibration=config.get("calibration") or [],
        compiled=rules.compile_simulation.output,
    output:
        **DIAGNOSED,
        verdict=f"{DIAGNOSIS}/diagnosis.json",
        report=f"{DIAGNOSIS}/report.html",
    log:
        f"{RESULTS}/logs/diagnoses/{configuration.bench_name(BENCH)}/diagnose_gap.log",
    benchmark:
        f"{RESULTS}/benchmarks/diagnoses/{configuration.bench_name(BENCH)}/diagnose_gap.tsv"
    threads: 2
    resources:
        mem_mb=more(2000),
        runtime=more(10),
        tracking=1,
    params:
        is_folder=os.path.isdir(BENCH),
        twin=TWIN,
        spec=configuration.diagnosis_spec(PLAN.cases[0].config),
        code=code("diagnose_gap"),
    script:
        "../scripts/diagnose_gap.py"


rule retrain_network:
    input:
        files=bench_files,
        verdict=rules.diagnose_gap.output.verdict,
        report=rules.diagnose_gap.output.report,
    output:
        result=f"{DIAGNOSIS}/retrained.json",
        report=f"{DIAGNOSIS}/retrained.html",
    log:
        f"{RESULTS}/logs/diagnoses/{configuration.bench_name(BENCH)}/retrain_network.log",
    benchmark:
        f"{RESULTS}/benchmarks/diagnoses/{configuration.bench_name(BENCH)}/retrain_network.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(30),
    params:
        is_folder=os.path.isdir(BENCH),
        spec=configuration.retraining_spec(PLAN.cases[0].config),
        code=code("retrain_network"),
    script:
        "../scripts/retrain_network.py"


rule diagnose:
    """Diagnose a bench."""
    input:
        rules.diagnose_gap.output,


rule retrain:
    """Retrain with what the diagnosis of a bench named, and show in its report what that brought."""
    input:
        rules.retrain_network.output,
