# Fault vectors are sampled, runs simulated and measured, and written in shards.


# It carries the digest of the simulation itself: what is compiled anew is simulated anew.
rule compile_simulation:
    output:
        f"{RESULTS}/compiled.txt",
    log:
        f"{RESULTS}/logs/compile_simulation.log",
    benchmark:
        f"{RESULTS}/benchmarks/compile_simulation.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(10),
    params:
        spec=configuration.recursively_sorted(vars(configuration.reference_actuator())),
        code=code("simulate_shard"),
    script:
        "../scripts/compile_simulation.py"


rule simulate_shard:
    input:
        compiled=rules.compile_simulation.output,
        command=command_of_dataset,
    output:
        f"{RESULTS}/datasets/{{dataset}}/{{part}}/shard_{{shard}}.nc",
    log:
        f"{RESULTS}/logs/{{dataset}}/simulate_{{part}}_{{shard}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/{{dataset}}/simulate_{{part}}_{{shard}}.tsv"
    resources:
        mem_mb=more(1000),
        runtime=more(20),
    params:
        spec=dataset_spec,
        code=code("simulate_shard"),
    script:
        "../scripts/simulate_shard.py"
