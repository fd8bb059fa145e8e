# Whether stated probabilities hold on an actuator of one's own.
#
#   snakemake --cores all calibration --config overrides=actuator=mine.yaml
#   emafault diagnose bench/ --actuator mine.yaml --calibration results/calibration/mine/calibration.json


rule time_calibration:
    input:
        rules.compile_simulation.output,
    output:
        f"{CALIBRATION}/pace.json",
    log:
        f"{RESULTS}/logs/calibration/{CALIBRATED}/time_calibration.log",
    benchmark:
        f"{RESULTS}/benchmarks/calibration/{CALIBRATED}/time_calibration.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(30),
    params:
        spec=calibration_spec,
        cases=code_of_calibration,
        code=code("time_calibration"),
    script:
        "../scripts/time_calibration.py"


rule diagnose_own_cases:
    input:
        rules.time_calibration.output,
    output:
        f"{CALIBRATION}/{{rung}}_{{batch}}.json",
    log:
        f"{RESULTS}/logs/calibration/{CALIBRATED}/{{rung}}_{{batch}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/calibration/{CALIBRATED}/{{rung}}_{{batch}}.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(240),
    params:
        spec=lambda wildcards: configuration.withheld_spec(
            "own", wildcards.rung, int(wildcards.batch), PLAN.cases[0].config
        ),
        code=code_of_calibration,
    script:
        "../scripts/diagnose_cases.py"


rule score_calibration:
    input:
        batches=calibration_batches,
        pace=rules.time_calibration.output,
    output:
        page=f"{CALIBRATION}/calibration.html",
        found=f"{CALIBRATION}/calibration.json",
    log:
        f"{RESULTS}/logs/calibration/{CALIBRATED}/score_calibration.log",
    benchmark:
        f"{RESULTS}/benchmarks/calibration/{CALIBRATED}/score_calibration.tsv"
    resources:
        mem_mb=more(1000),
        runtime=more(20),
    params:
        spec=calibration_spec,
        code=code("score_calibration"),
    script:
        "../scripts/score_calibration.py"


rule calibration:
    """Check on blind cases whether stated probabilities hold on an actuator; says beforehand how long it takes."""
    input:
        rules.score_calibration.output,
