# Machines that were really measured: every set of data/measured diagnosed into one page.
MEASURED = "data/measured"
CALIBRATIONS = "src/emafault/twins/calibrations"


rule diagnose_measured:
    input:
        sets=f"{MEASURED}/sets.yaml",
        nameplate=f"{MEASURED}/nameplate.yaml",
        calibrations=expand(f"{CALIBRATIONS}/{{twin}}.json", twin=glob_wildcards(f"{CALIBRATIONS}/{{twin}}.json").twin),
        files=[
            f"{MEASURED}/{path}"
            for path in glob_wildcards(f"{MEASURED}/{{path}}").path
            if path.endswith((".npz", ".csv.gz"))
        ],
    output:
        report=f"{RESULTS}/measured/report.html",
        figures=directory(f"{RESULTS}/measured/figures"),
        verdicts=f"{RESULTS}/measured/verdicts.json",
        withheld=f"{RESULTS}/measured/withheld.json",
    log:
        f"{RESULTS}/logs/measured/diagnose_measured.log",
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        code=code("diagnose_measured"),
    script:
        "../scripts/diagnose_measured.py"


rule diagnose_machines:
    input:
        sets=rules.diagnose_measured.input.sets,
        files=rules.diagnose_measured.input.files,
        verdicts=rules.diagnose_measured.output.verdicts,
        withheld=rules.diagnose_measured.output.withheld,
    output:
        report=f"{RESULTS}/measured/equations/report.html",
        figures=directory(f"{RESULTS}/measured/equations/figures"),
        verdicts=f"{RESULTS}/measured/equations/verdicts.json",
        withheld=f"{RESULTS}/measured/equations/withheld.json",
    log:
        f"{RESULTS}/logs/measured/diagnose_machines.log",
    resources:
        mem_mb=1000,
        runtime=20,
    params:
        code=code("diagnose_machines"),
    script:
        "../scripts/diagnose_machines.py"


rule calibrate_measured:
    input:
        sets=rules.diagnose_measured.input.sets,
        files=rules.diagnose_measured.input.files,
    output:
        calibrations=directory(f"{RESULTS}/measured/calibrations"),
        check=f"{RESULTS}/measured/calibration_check.json",
    log:
        f"{RESULTS}/logs/measured/calibrate_measured.log",
    resources:
        mem_mb=1000,
        runtime=10,
    params:
        draws=150,
        seed=1,
        code=code("calibrate_measured"),
    script:
        "../scripts/calibrate_measured.py"


rule measured_calibration:
    """Calibrate what is believed of measured machines anew."""
    input:
        rules.calibrate_measured.output.calibrations,


rule measured:
    """Diagnose the measured machines, by their equations and against simulation."""
    input:
        rules.diagnose_machines.output.report,
        rules.diagnose_measured.output.report,
