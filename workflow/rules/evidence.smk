# The check of the evidence: parameters drawn from the priors of the diagnosis, data from its linear model.


rule check_evidence:
    output:
        report=f"{RESULTS}/evidence/report.html",
        figures=directory(f"{RESULTS}/evidence/figures"),
        scores=f"{RESULTS}/evidence/scores.json",
    log:
        f"{RESULTS}/logs/evidence/check_evidence.log",
    benchmark:
        f"{RESULTS}/benchmarks/evidence/check_evidence.tsv"
    resources:
        mem_mb=more(1000),
        runtime=more(20),
    params:
        spec=lambda wildcards: configuration.evidence_spec(),
        code=code("check_evidence"),
    script:
        "../scripts/check_evidence.py"


rule evidence:
    """Check the evidence by draws from its own priors."""
    input:
        rules.check_evidence.output.report,
