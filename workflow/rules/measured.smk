# Machines that were really measured: every set of data/measured diagnosed into one page.
MEASURED = "data/measured"


rule diagnose_machines:
    input:
        sets=local(f"{MEASURED}/sets.yaml"),
        nameplate=local(f"{MEASURED}/nameplate.yaml"),
        files=[
            local(f"{MEASURED}/{path}")
            for path in glob_wildcards(f"{MEASURED}/{{path}}").path
            if path.endswith((".npz", ".csv.gz"))
        ],
    output:
        report=f"{RESULTS}/measured/report.html",
        figures=directory(f"{RESULTS}/measured/figures"),
        verdicts=f"{RESULTS}/measured/verdicts.json",
        withheld=f"{RESULTS}/measured/withheld.json",
    log:
        f"{RESULTS}/logs/measured/diagnose_machines.log",
    benchmark:
        f"{RESULTS}/benchmarks/measured/diagnose_machines.tsv"
    resources:
        mem_mb=more(1000),
        runtime=more(20),
    params:
        code=code("diagnose_machines"),
    script:
        "../scripts/diagnose_machines.py"


rule measured:
    """Diagnose the measured machines."""
    input:
        rules.diagnose_machines.output.report,
