# Estimators are trained, searched for, exported and evaluated.


rule search_network:
    input:
        training_features,
    output:
        f"{CASE}/search/worker_{{worker}}.json",
    log:
        f"{RESULTS}/logs/{{case}}/search_{{worker}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/search_{{worker}}.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(240),
    params:
        spec=search_spec,
        code=code("search_network"),
        storage=search_storage,
    script:
        "../scripts/search_network.py"


rule choose_network:
    input:
        searching_workers,
    output:
        trials=f"{CASE}/search/trials.json",
        chosen=f"{CASE}/search/chosen.json",
    log:
        f"{RESULTS}/logs/{{case}}/choose_network.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/choose_network.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(10),
    params:
        spec=search_spec,
        code=code("choose_network"),
    script:
        "../scripts/choose_network.py"


rule train_seed:
    input:
        features=training_features,
        chosen=chosen_network,
    output:
        temp(directory(f"{CASE}/identifiers/{{method}}/{{estimator}}.{{seed}}")),
    log:
        f"{RESULTS}/logs/{{case}}/train_{{method}}_{{estimator}}_{{seed}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/train_{{method}}_{{estimator}}_{{seed}}.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(60),
    params:
        spec=seed_spec,
        code=code("train_identifier"),
    script:
        "../scripts/train_identifier.py"


# of many runs it joins what was trained seed by seed
rule train_identifier:
    input:
        unpack(trained_from),
    output:
        directory(f"{CASE}/identifiers/{{method}}/{{estimator}}"),
    log:
        f"{RESULTS}/logs/{{case}}/train_{{method}}_{{estimator}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/train_{{method}}_{{estimator}}.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(30),
    params:
        spec=training_spec,
        code=code("train_identifier"),
    script:
        "../scripts/train_identifier.py"


rule export_network:
    input:
        features=exported_features,
        network=exported_network,
    output:
        model=f"{CASE}/export/network.onnx",
        calibrated=f"{CASE}/export/network_calibrated.onnx",
        source=f"{CASE}/export/network.c",
        check=f"{CASE}/export/check.json",
    log:
        f"{RESULTS}/logs/{{case}}/export_network.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/export_network.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(10),
    params:
        code=code("export_network"),
    script:
        "../scripts/export_network.py"


rule evaluate_identification:
    input:
        estimators=estimators,
        fresh=fresh_features,
        references=reference_features,
        bound=rules.compute_bound.output,
    output:
        metrics=f"{CASE}/evaluation/metrics.json",
        estimates=f"{CASE}/evaluation/estimates.nc",
    log:
        f"{RESULTS}/logs/{{case}}/evaluate_identification.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/evaluate_identification.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(30),
    params:
        spec=evaluation_spec,
        code=code("evaluate_identification"),
    script:
        "../scripts/evaluate_identification.py"
