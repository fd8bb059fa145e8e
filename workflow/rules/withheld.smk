# The withheld check: blind cases, their diagnoses, the scoreboard; and the calibration of the probabilities on a draw of its own.


wildcard_constraints:
    draw="|".join(configuration.withheld_draws()),
    rung=r"T\d",
    batch=r"\d+",


rule diagnose_cases:
    output:
        f"{WITHHELD}/{{draw}}/{{rung}}_{{batch}}.json",
    log:
        f"{RESULTS}/logs/withheld/{{draw}}/{{rung}}_{{batch}}.log",
    resources:
        mem_mb=2000,
        runtime=240,
    params:
        spec=lambda wildcards: configuration.withheld_spec(wildcards.draw, wildcards.rung, int(wildcards.batch)),
        code=code("diagnose_cases"),
    script:
        "../scripts/diagnose_cases.py"


rule score_cases:
    input:
        batches=withheld_batches,
        measured=rules.diagnose_measured.output.withheld,
        where=rules.prepare_tracking.output,
    output:
        report=f"{WITHHELD}/{{draw}}/scoreboard.html",
        scores=f"{WITHHELD}/{{draw}}/scores.json",
    log:
        f"{RESULTS}/logs/withheld/{{draw}}/score_cases.log",
    threads: 8
    resources:
        mem_mb=2000,
        runtime=20,
        tracking=1,
    params:
        code=code("score_cases"),
    script:
        "../scripts/score_cases.py"


rule calibrate_diagnosis:
    input:
        lambda wildcards: [
            f"{WITHHELD}/development/{rung}_{n}.json" for rung, n in configuration.withheld_jobs("development")
        ],
    output:
        f"{WITHHELD}/calibration.json",
    log:
        f"{RESULTS}/logs/withheld/calibrate_diagnosis.log",
    resources:
        mem_mb=1000,
        runtime=5,
    params:
        code=code("calibrate_diagnosis"),
    script:
        "../scripts/calibrate_diagnosis.py"


rule withheld:
    """The standard scoreboard."""
    input:
        f"{WITHHELD}/standard/scoreboard.html",


rule withheld_by_simulation:
    """The standard scoreboard's benches, diagnosed against simulated recordings."""
    input:
        f"{WITHHELD}/standard_by_simulation/scoreboard.html",


rule withheld_full:
    """The large scoreboard; resumes."""
    input:
        f"{WITHHELD}/full/scoreboard.html",


rule withheld_brief:
    """One case per effect and rung."""
    input:
        f"{WITHHELD}/brief/scoreboard.html",


rule withheld_smallest:
    """A handful of cases, for the tests."""
    input:
        f"{WITHHELD}/smallest/scoreboard.html",


rule calibration:
    """Calibrate the probabilities of the diagnosis anew."""
    input:
        rules.calibrate_diagnosis.output,
