# Resistances and back-EMF coefficients are reconstructed from each run; their accuracy is bounded from below.


rule reconstruct_features:
    input:
        shards_of_part,
    output:
        f"{CASE}/features/{{part}}_{{method}}.nc",
    log:
        f"{RESULTS}/logs/{{case}}/reconstruct_{{part}}_{{method}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/reconstruct_{{part}}_{{method}}.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(60),
    params:
        spec=reconstruction_spec,
        code=code("reconstruct_features"),
    script:
        "../scripts/reconstruct_features.py"


rule compute_bound:
    input:
        rules.compile_simulation.output,
    output:
        f"{CASE}/bound.nc",
    log:
        f"{RESULTS}/logs/{{case}}/compute_bound.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/compute_bound.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(60),
    params:
        spec=bound_spec,
        code=code("compute_bound"),
    script:
        "../scripts/compute_bound.py"
