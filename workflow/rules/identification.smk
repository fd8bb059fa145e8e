# Estimators are trained, searched for, exported and evaluated.
CASE = f"{RESULTS}/experiments/{{case}}"


def training_features(wildcards):
    method = (
        getattr(wildcards, "method", None)
        or case_of(wildcards).config["search"]["reconstruction"]
    )
    return f"{RESULTS}/experiments/{wildcards.case}/features/training_{method}.nc"


def chosen_network(wildcards):
    return (
        f"{RESULTS}/experiments/{wildcards.case}/search/chosen.json"
        if wildcards.estimator == "searched"
        else []
    )


def training_spec(wildcards):
    return configuration.network_spec(case_of(wildcards).config, wildcards.estimator)


def search_spec(wildcards):
    return configuration.search_spec(case_of(wildcards).config)


def search_storage(wildcards):
    own = f"{RESULTS}/experiments/{wildcards.case}/search/journal.log"
    return case_of(wildcards).config["search"]["storage"] or own


def searching_workers(wildcards):
    number = case_of(wildcards).config["search"]["workers"]
    return [
        f"{RESULTS}/experiments/{wildcards.case}/search/worker_{worker}.json"
        for worker in range(number)
    ]


def histories(wildcards):
    case = case_of(wildcards)
    folder = f"{RESULTS}/experiments/{case.path}/identifiers"
    methods = case.config["reconstruction"]
    return [
        f"{folder}/{method}/{name}/history.json"
        for method in methods
        for name in estimators(case, method)
    ]


def features_of(part):
    def paths(wildcards):
        case = case_of(wildcards)
        return [
            path
            for path in all_features(case)
            if path.split("/")[-1].startswith(f"{part}_")
        ]

    return paths


def exported_identifier(wildcards):
    case = case_of(wildcards)
    search = case.config["search"]
    methods = list(case.config["reconstruction"])
    method = (
        search["reconstruction"] if search["reconstruction"] in methods else methods[-1]
    )
    estimator = "searched" if search["trials"] else "network"
    return f"{RESULTS}/experiments/{case.path}/identifiers/{method}/{estimator}/history.json"


def evaluation_spec(wildcards):
    return configuration.evaluation_spec(case_of(wildcards).config)


rule search_network:
    input:
        training_features,
    output:
        f"{CASE}/search/worker_{{worker}}.json",
    resources:
        mem_mb=2000,
        runtime=240,
    params:
        spec=search_spec,
        code=code("search_network"),
        storage=search_storage,
    script:
        "../scripts/search_network.py"


rule choose_network:
    input:
        features=training_features,
        workers=searching_workers,
    output:
        trials=f"{CASE}/search/trials.json",
        chosen=f"{CASE}/search/chosen.json",
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        spec=search_spec,
        code=code("choose_network"),
        storage=search_storage,
    script:
        "../scripts/choose_network.py"


rule train_identifier:
    input:
        features=training_features,
        chosen=chosen_network,
    output:
        f"{CASE}/identifiers/{{method}}/{{estimator}}/history.json",
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        spec=training_spec,
        code=code("train_identifier"),
    script:
        "../scripts/train_identifier.py"


rule export_network:
    input:
        features=rules.train_identifier.input.features,
        history=exported_identifier,
    output:
        model=f"{CASE}/export/network.onnx",
        check=f"{CASE}/export/check.json",
    resources:
        mem_mb=2000,
        runtime=10,
    params:
        code=code("export_network"),
    script:
        "../scripts/export_network.py"


rule evaluate_identification:
    input:
        histories=histories,
        fresh=features_of("fresh"),
        references=features_of("reference"),
        bound=rules.compute_bound.output,
    output:
        metrics=f"{CASE}/evaluation/metrics.json",
        estimates=f"{CASE}/evaluation/estimates.nc",
    resources:
        mem_mb=2000,
        runtime=30,
    params:
        spec=evaluation_spec,
        code=code("evaluate_identification"),
    script:
        "../scripts/evaluate_identification.py"
