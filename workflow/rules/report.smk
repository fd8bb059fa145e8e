# The resolved configuration is written down, figures are drawn, everything is tracked.


rule write_configuration:
    output:
        f"{CASE}/configuration.yaml",
    log:
        f"{RESULTS}/logs/{{case}}/write_configuration.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/write_configuration.tsv"
    localrule: True
    params:
        spec=whole_configuration,
        code=code("write_configuration"),
    script:
        "../scripts/write_configuration.py"


rule simulate_examples:
    input:
        compiled=rules.compile_simulation.output,
        command=command_of_case,
    output:
        f"{CASE}/examples.nc",
    log:
        f"{RESULTS}/logs/{{case}}/simulate_examples.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/simulate_examples.tsv"
    resources:
        mem_mb=more(1000),
        runtime=more(10),
    params:
        spec=examples_spec,
        code=code("simulate_examples"),
    script:
        "../scripts/simulate_examples.py"


rule draw_report:
    input:
        metrics=rules.evaluate_identification.output.metrics,
        estimates=rules.evaluate_identification.output.estimates,
        estimators=estimators,
        examples=rules.simulate_examples.output,
        search=search_results,
        configuration=rules.write_configuration.output,
    output:
        report=f"{CASE}/report.html",
        figures=directory(f"{CASE}/figures"),
    log:
        f"{RESULTS}/logs/{{case}}/draw_report.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/draw_report.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(10),
    params:
        spec=title_and_question,
        code=code("draw_report"),
    script:
        "../scripts/draw_report.py"


if PLAN.is_study:

    rule compare_variants:
        input:
            case_files("evaluation/metrics.json"),
        output:
            report=f"{EXPERIMENT}/report.html",
            figures=directory(f"{EXPERIMENT}/figures"),
        log:
            f"{RESULTS}/logs/{PLAN.name}/compare_variants.log",
        benchmark:
            f"{RESULTS}/benchmarks/{PLAN.name}/compare_variants.tsv"
        resources:
            mem_mb=more(1000),
            runtime=more(10),
        params:
            spec={
                "title": PLAN.name,
                "question": PLAN.question,
                "variants": [case.path.split("/")[-1] for case in PLAN.cases],
                "learnt_from": PLAN.learnt_from,
            },
            code=code("compare_variants"),
        script:
            "../scripts/compare_variants.py"


# The database is neither input nor output of a rule; one job writes at a time (profiles/default).
rule prepare_tracking:
    output:
        f"{RESULTS}/tracking.json",
    log:
        f"{RESULTS}/logs/prepare_tracking.log",
    benchmark:
        f"{RESULTS}/benchmarks/prepare_tracking.tsv"
    localrule: True
    resources:
        tracking=1,
        mem_mb=more(1000),
        runtime=more(10),
    params:
        spec=configuration.recursively_sorted(PLAN.cases[0].config["tracking"]),
        code=code("prepare_tracking"),
    script:
        "../scripts/prepare_tracking.py"


rule track_evaluation:
    input:
        where=rules.prepare_tracking.output,
        metrics=rules.evaluate_identification.output.metrics,
        estimators=estimators,
        search=search_results,
        model=rules.export_network.output.model,
        calibrated=rules.export_network.output.calibrated,
        source=rules.export_network.output.source,
        exported=exported_network,
        report=rules.draw_report.output.report,
        figures=rules.draw_report.output.figures,
        configuration=rules.write_configuration.output,
    output:
        f"{CASE}/tracked.json",
    log:
        f"{RESULTS}/logs/{{case}}/track_evaluation.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/track_evaluation.tsv"
    localrule: True
    resources:
        tracking=1,
        mem_mb=more(1000),
        runtime=more(10),
    params:
        spec=whole_configuration,
        data=data_of_case,
        code=code("track_evaluation"),
    script:
        "../scripts/track_evaluation.py"
