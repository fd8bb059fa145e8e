# The resolved configuration is written down, figures are drawn, everything is tracked.


def whole_configuration(wildcards):
    return configuration.recursively_sorted(case_of(wildcards).config)


rule write_configuration:
    output:
        f"{CASE}/configuration.yaml",
    params:
        spec=whole_configuration,
        code=code("write_configuration"),
    script:
        "../scripts/write_configuration.py"
