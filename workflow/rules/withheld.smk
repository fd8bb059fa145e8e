# The withheld check: blind cases, their diagnoses, the scoreboard.


wildcard_constraints:
    draw="|".join(configuration.withheld_draws()),
    rung=r"T\d",
    batch=r"\d+",


rule diagnose_cases:
    input:
        rules.compile_simulation.output,
    output:
        f"{WITHHELD}/{{draw}}/{{rung}}_{{batch}}.json",
    log:
        f"{RESULTS}/logs/withheld/{{draw}}/{{rung}}_{{batch}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/withheld/{{draw}}/{{rung}}_{{batch}}.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(240),
    params:
        spec=lambda wildcards: configuration.withheld_spec(wildcards.draw, wildcards.rung, int(wildcards.batch)),
        code=code("diagnose_cases"),
    script:
        "../scripts/diagnose_cases.py"


rule score_cases:
    input:
        batches=withheld_batches,
        measured=withheld_measured,
        where=rules.prepare_tracking.output,
    output:
        report=f"{WITHHELD}/{{draw}}/scoreboard.html",
        scores=f"{WITHHELD}/{{draw}}/scores.json",
        figures=[f"{WITHHELD}/{{draw}}/{name}.png" for name in ("confusion", "reliability", "power", "closure")],
    log:
        f"{RESULTS}/logs/withheld/{{draw}}/score_cases.log",
    benchmark:
        f"{RESULTS}/benchmarks/withheld/{{draw}}/score_cases.tsv"
    threads: 2
    resources:
        mem_mb=more(2000),
        runtime=more(20),
        tracking=1,
    params:
        code=code("score_cases"),
    script:
        "../scripts/score_cases.py"


rule withheld:
    """The standard scoreboard."""
    input:
        f"{WITHHELD}/standard/scoreboard.html",


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
