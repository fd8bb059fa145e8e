# Resistances and back-EMF coefficients are reconstructed from each run; their accuracy is bounded from below.


rule reconstruct_block:
    input:
        shards_of_block,
    output:
        temp(f"{CASE}/features/{{part}}_{{method}}.{{block}}.nc"),
    log:
        f"{RESULTS}/logs/{{case}}/reconstruct_{{part}}_{{method}}_{{block}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/reconstruct_{{part}}_{{method}}_{{block}}.tsv"
    resources:
        mem_mb=more(1000),
        runtime=more(20),
    params:
        spec=reconstruction_spec,
        code=code("reconstruct_features"),
    script:
        "../scripts/reconstruct_features.py"


# of many runs it joins what was reconstructed from blocks of them
rule reconstruct_features:
    input:
        reconstructed_from,
    output:
        f"{CASE}/features/{{part}}_{{method}}.nc",
    log:
        f"{RESULTS}/logs/{{case}}/reconstruct_{{part}}_{{method}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/reconstruct_{{part}}_{{method}}.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(20),
    params:
        spec=reconstruction_spec,
        joined=lambda wildcards: bool(blocks_of_part(wildcards)),
        code=code("reconstruct_features"),
    script:
        "../scripts/reconstruct_features.py"


rule compute_bound:
    input:
        compiled=rules.compile_simulation.output,
        command=command_of_case,
    output:
        f"{CASE}/bound.nc",
    log:
        f"{RESULTS}/logs/{{case}}/compute_bound.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{case}}/compute_bound.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(20),
    params:
        spec=bound_spec,
        code=code("compute_bound"),
    script:
        "../scripts/compute_bound.py"
