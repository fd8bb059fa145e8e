# Machines that were really measured: every set of data/measured diagnosed into one page.
MEASURED = "data/measured"


rule diagnose_measured:
    input:
        f"{MEASURED}/sets.yaml",
    output:
        report=f"{RESULTS}/measured/report.html",
        figures=directory(f"{RESULTS}/measured/figures"),
        verdicts=f"{RESULTS}/measured/verdicts.json",
        withheld=f"{RESULTS}/measured/withheld.json",
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("diagnose_measured"),
    script:
        "../scripts/diagnose_measured.py"


rule measured:
    """Diagnose the measured machines."""
    input:
        rules.diagnose_measured.output.report,
