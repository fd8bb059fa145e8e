# Resistances and back-EMF coefficients are reconstructed from each run, and bounded from below.


def shards_of_part(wildcards):
    return shards(case_of(wildcards), wildcards.part)


def reconstruction_spec(wildcards):
    return configuration.reconstruction_spec(
        case_of(wildcards).config, wildcards.method
    )


def bound_spec(wildcards):
    return configuration.bound_spec(case_of(wildcards).config)


rule reconstruct_features:
    input:
        shards_of_part,
    output:
        f"{RESULTS}/experiments/{{case}}/features/{{part}}_{{method}}.nc",
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        spec=reconstruction_spec,
        code=code("reconstruct_features"),
    script:
        "../scripts/reconstruct_features.py"


rule compute_bound:
    input:
        rules.compile_simulation.output,
    output:
        f"{RESULTS}/experiments/{{case}}/bound.nc",
    resources:
        mem_mb=2000,
        runtime=60,
    params:
        spec=bound_spec,
        code=code("compute_bound"),
    script:
        "../scripts/compute_bound.py"
