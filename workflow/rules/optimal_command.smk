# The command, length and load that identify best within limits: searched by the bound, simulated to confirm.
#
#   snakemake --cores all optimal_command


OPTIMAL = f"{RESULTS}/optimal_command"
SEARCHED = [f"{OPTIMAL}/length_{n}.json" for n in range(len(configuration.design_lengths()))]


rule search_command:
    input:
        rules.compile_simulation.output,
    output:
        f"{OPTIMAL}/length_{{length}}.json",
    log:
        f"{RESULTS}/logs/optimal_command/search_command_{{length}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/optimal_command/search_command_{{length}}.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(30),
    params:
        spec=configuration.design_spec(),
        length=lambda wildcards: configuration.design_lengths()[int(wildcards.length)],
        code=code("search_command"),
    script:
        "../scripts/search_command.py"


rule confirm_commands:
    input:
        SEARCHED,
    output:
        f"{OPTIMAL}/confirmed.json",
    log:
        f"{RESULTS}/logs/optimal_command/confirm_commands.log",
    benchmark:
        f"{RESULTS}/benchmarks/optimal_command/confirm_commands.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(30),
    params:
        spec=configuration.design_spec(),
        code=code("confirm_commands"),
    script:
        "../scripts/confirm_commands.py"


rule draw_commands:
    input:
        searched=SEARCHED,
        confirmed=rules.confirm_commands.output,
    output:
        report=f"{OPTIMAL}/report.html",
        figures=directory(f"{OPTIMAL}/figures"),
    log:
        f"{RESULTS}/logs/optimal_command/draw_commands.log",
    benchmark:
        f"{RESULTS}/benchmarks/optimal_command/draw_commands.tsv"
    resources:
        mem_mb=more(2000),
        runtime=more(10),
    params:
        spec=configuration.design_spec(),
        code=code("draw_commands"),
    script:
        "../scripts/draw_commands.py"


rule optimal_command:
    """Search the command that identifies best."""
    input:
        rules.draw_commands.output.report,
