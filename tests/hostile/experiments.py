"""Experiment files that are no experiment, or ask for what cannot be; and odd names of good ones."""

from .entries import Entry, Prepare, entry, file

GOOD = "# @package _global_\nquestion: Does it compose?\n"
HEAD = "# @package _global_\n"
SMOKE = "question: q\ndefaults:\n  - override /search: none\n"


def _refused(text: str | bytes, *says: str, name: str = "mine.yaml") -> Entry:
    return entry(f"simulate out.nc --experiment {name}", *(says or (name,)), prepare=file(name, text))


def _accepted(name: str) -> Entry:
    words = ("simulate", "out.nc", "recording.duration=0.2", "recording.discard=0.05", "--experiment", name)
    return Entry(words, (), file(name, GOOD))


#: text of mine.yaml -> what must be named
TEXTS: dict[str, tuple[str | bytes, tuple[str, ...]]] = {
    "empty": ("", ("mine.yaml",)),
    "a comment alone": (HEAD, ("mine.yaml",)),
    "a word alone": ("word", ("mine.yaml", "mapping")),
    "a number": ("5", ("mine.yaml", "mapping")),
    "a list": ("- a\n- b\n", ("mine.yaml", "mapping")),
    "null": ("null", ("mine.yaml",)),
    "python tag": (f"{HEAD}question: !!python/object/apply:os.getcwd []\n", ("mine.yaml", "python")),
    "python name": (f"{HEAD}name: !!python/name:os.system\n", ("mine.yaml", "python")),
    "own tag": (f"{HEAD}name: !mine x\n", ("mine.yaml", "!mine")),
    "binary": (f"{HEAD}question: !!binary aGVsbG8=\n", ("question",)),
    "a set": (f"{HEAD}effects: !!set {{a, b}}\n", ("effects",)),
    "tab": (f"{HEAD}effects:\n\tstribeck: {{a: 0.01}}\n", ("mine.yaml", "line 3")),
    "unclosed": (f"{HEAD}effects: {{stribeck: {{a: 0.01}}\n", ("mine.yaml", "line")),
    "latin-1": (f"{HEAD}question: Für den Bench\n".encode("latin-1"), ("mine.yaml", "UTF-8")),
    "utf-16": (f"{HEAD}question: q\n".encode("utf-16"), ("mine.yaml", "UTF-8")),
    "utf-32": (f"{HEAD}question: q\n".encode("utf-32"), ("mine.yaml", "UTF-8")),
    "random bytes": (bytes(range(256)) * 4, ("mine.yaml",)),
    "NUL": (f"{HEAD}question: a\0b\n", ("mine.yaml",)),
    "NUL in quotes": (
        f'{HEAD}defaults:\n  - override /command: file\ncommand: {{path: "a\\0b"}}\n',
        ("command.path", "NUL"),
    ),
    "bell": (f"{HEAD}question: a\x07b\n", ("mine.yaml",)),
    "duplicate key": (f"{HEAD}question: a\nquestion: b\n", ("mine.yaml", "question")),
    "duplicate key below": (f"{HEAD}faults:\n  N: {{low: 0.0, low: 0.1}}\n", ("mine.yaml", "low")),
    "two documents": (f"{HEAD}question: a\n---\nquestion: b\n", ("mine.yaml", "document")),
    "alias of itself": (f"{HEAD}effects: &a\n  stribeck: *a\n", ("mine.yaml",)),
    "unknown alias": (f"{HEAD}effects: *nothing\n", ("mine.yaml", "nothing")),
    "billion laughs": (
        HEAD
        + "a: &a [x, x, x, x, x, x, x, x, x, x]\n"
        + "".join(f"{k}: &{k} [{', '.join([f'*{j}'] * 10)}]\n" for j, k in zip("abcdefgh", "bcdefghi")),
        ("mine.yaml",),
    ),
    "deep": (HEAD + "question: " + "[" * 2000 + "]" * 2000 + "\n", ("mine.yaml",)),
    "key that is no word": (f"{HEAD}5: 6\n", ("5", "there is no such key")),
    "null key": (f"{HEAD}~: 6\n", ("mine.yaml",)),
    "list as key": (f"{HEAD}? [a, b]\n: 6\n", ("mine.yaml",)),
    "unknown key": (f"{HEAD}questoin: a\n", ("questoin", "did you mean question")),
    "unknown group": (f"{HEAD}defaults:\n  - override /comand: sine\n", ("comand",)),
    "unknown option": (f"{HEAD}defaults:\n  - override /command: warp\n", ("command", "warp")),
    "defaults a word": (f"{HEAD}defaults: paper\n", ("mine.yaml", "defaults")),
    "defaults a number": (f"{HEAD}defaults: [5]\n", ("mine.yaml", "defaults")),
    "defaults a mapping": (f"{HEAD}defaults: {{override /command: sine}}\n", ("mine.yaml", "defaults")),
    "defaults refer to the file": (f"{HEAD}defaults:\n  - mine\n", ("mine",)),
    "defaults refer to all": (f"{HEAD}defaults:\n  - /config\n", ("defaults",)),
    "defaults twice": (
        f"{HEAD}defaults:\n  - override /command: sine\n  - override /command: ramp\n",
        ("command",),
    ),
    "no package": ("question: a\n", ("experiment",)),
    "question missing": (f"{HEAD}question: ???\n", ("question: needs a value",)),
    "value missing": (f'{HEAD}faults: {{law: "???"}}\n', ("faults.law: needs a value",)),
    "interpolation to nothing": (f"{HEAD}question: ${{nothing.here}}\n", ("nothing",)),
    "interpolation to itself": (f"{HEAD}question: ${{question}}\n", ("question",)),
    "interpolation in a ring": (f"{HEAD}question: ${{dataset}}\ndataset: ${{question}}\n", ("question",)),
    "unknown resolver": (f"{HEAD}question: ${{magic:5}}\n", ("magic",)),
    "unclosed interpolation": (f"{HEAD}question: ${{a\n", ("question",)),
    "variable of the environment": (f"{HEAD}question: ${{oc.env:NOT_THERE_AT_ALL}}\n", ("NOT_THERE_AT_ALL",)),
    "variant outside": (f'{HEAD}variants: {{"../../x": [command=sine], b: []}}\n', ("variants", "../../x", "letters")),
    "variant at the root": (f'{HEAD}variants: {{"/tmp/x": []}}\n', ("variants", "/tmp/x")),
    "variant of dots": (f'{HEAD}variants: {{"..": []}}\n', ("variants", "..")),
    "variant of braces": (f'{HEAD}variants: {{"{{case}}": []}}\n', ("variants", "{case}")),
    "variant of two lines": (f'{HEAD}variants: {{"a\\nb": []}}\n', ("variants",)),
    "variant without name": (f'{HEAD}variants: {{"": []}}\n', ("variants",)),
    "variant a number": (f"{HEAD}variants: {{5: []}}\n", ("variants", "5")),
    "variants a list": (f"{HEAD}variants: [a, b]\n", ("variants", "a mapping")),
    "variant a word": (f"{HEAD}variants: {{a: command=sine}}\n", ("variants.a", "a list")),
    "variant of numbers": (f"{HEAD}variants: {{a: [5]}}\n", ("variants.a[0]", "a word")),
    "long variant": (f"{HEAD}variants: {{{'v' * 500}: []}}\n", ("variants",)),
    "name outside": (f"{HEAD}name: ../x\n", ("name", "'../x'")),
    "name of dots": (f"{HEAD}name: ..\n", ("name", "'..'")),
    "name of braces": (f"{HEAD}name: '{{case}}'\n", ("name", "{case}")),
    "name a number": (f"{HEAD}name: 5\n", ("name", "5")),
    "name a list": (f"{HEAD}name: [a]\n", ("name", "'a'")),
    "name of two lines": (f'{HEAD}name: "a\\nb"\n', ("name",)),
    "long name": (f"{HEAD}name: {'n' * 300}\n", ("name", "100")),
    "dataset outside": (f"{HEAD}dataset: /etc/x\n", ("dataset", "/etc/x")),
    "dataset a number": (f"{HEAD}dataset: 1.5\n", ("dataset", "1.5")),
    "actuator null": (f"{HEAD}actuator: null\n", ("actuator", "None")),
    "actuator a number": (f"{HEAD}actuator: 5\n", ("actuator",)),
    "faults null": (f"{HEAD}faults: null\n", ("faults",)),
    "effects a list": (f"{HEAD}effects: [stribeck]\n", ("effects", "a mapping")),
    "effects null": (f"{HEAD}effects: null\n", ("effects",)),
    "effect a number": (f"{HEAD}effects: {{stribeck: 5}}\n", ("effects.stribeck", "5")),
    "effect a word": (f"{HEAD}effects: {{stribeck: {{a: much}}}}\n", ("effects.stribeck.a", "'much'")),
    "effect NaN": (f"{HEAD}effects: {{stribeck: {{a: .nan}}}}\n", ("effects.stribeck.a", "nan")),
    "effect infinite": (f"{HEAD}effects: {{stribeck: {{a: .inf}}}}\n", ("effects.stribeck.a", "inf")),
    "effect impossible": (f"{HEAD}effects: {{stribeck: {{a: -1000}}}}\n", ("effects.stribeck.a", "-1000", "N m")),
    "effect true": (f"{HEAD}effects: {{stribeck: {{a: true}}}}\n", ("effects.stribeck.a", "True")),
    "command null": (f"{HEAD}command: null\n", ("command",)),
    "command named in two ways": (f"{HEAD}command: {{name: sine}}\n", ("command",)),
    "reconstruction a list": (f"{HEAD}reconstruction: [paper]\n", ("reconstruction",)),
    "reconstruction outside": (
        f'{HEAD}reconstruction: {{"../../x": {{method: paper, discard: 0.05, cutoff: 1.0, threshold: 0.1, '
        "least_speed: 1.0}}\n",
        ("reconstruction", "../../x"),
    ),
    "search space a list": (f"{HEAD}search: {{space: [a]}}\n", ("search.space",)),
    "search space a number": (f"{HEAD}search: {{space: {{network: 5}}}}\n", ("search.space.network", "5")),
    "search space without high": (
        f"{HEAD}search: {{space: {{network: {{width: {{low: 1, high: null}}}}}}}}\n",
        ("search.space.network.width",),
    ),
    "search space of words": (
        f"{HEAD}search: {{space: {{network: {{width: {{low: a, high: b}}}}}}}}\n",
        ("search.space.network.width", "'a'"),
    ),
    "numbers of 5000 digits": (f"{HEAD}sampling: {{runs: {'9' * 5000}}}\n", ("mine.yaml",)),
    "number too large": (f"{HEAD}faults: {{dT: {{high: 1e999}}}}\n", ("faults.dT.high", "inf")),
    "duration of 1e300": (f"{HEAD}recording: {{duration: 1.0e300}}\n", ("recording.duration", "3600")),
    "hydra's own keys": (f"{HEAD}hydra: {{run: {{dir: /tmp/x}}}}\n", ("hydra",)),
    "another searchpath": (f"{HEAD}hydra:\n  searchpath: [file:///etc]\n", ("hydra",)),
}

#: names of files that hold a good experiment, though YAML or Hydra read something else in the name
ODD_BUT_GOOD = ("nan", "1", "null", "true", "1e5", "off", "0x10", "None", "config", "paper", "inf", "2020-01-01", "a.b")
#: names that cannot become a folder of results
ODD = (
    "a=b,c",
    "a b",
    "${name}",
    "{case}",
    "[a]",
    "a'b",
    'a"b',
    "a&b",
    "~",
    "+a",
    "@a",
    "a:b",
    "ü",
    "-a",
    "a\nb",
    "a;b",
)

ENTRIES: dict[str, Entry] = {f"experiment, {name}": _refused(text, *says) for name, (text, says) in TEXTS.items()}
ENTRIES |= {f"experiment named {name}": _accepted(f"{name}.yaml") for name in ODD_BUT_GOOD}
ENTRIES |= {
    f"experiment named {name!r}": Entry(
        ("simulate", "out.nc", f"--experiment={name}.yaml"),
        (" ".join(f"{name}.yaml".split()), "letters"),
        file(f"{name}.yaml", GOOD),
    )
    for name in ODD
}


def _link(target: str) -> Prepare:
    return lambda folder: (folder / "mine.yaml").symlink_to(target)


def _elsewhere(path: str, *says: str, prepare: Prepare | None = None) -> Entry:
    return Entry(("simulate", "out.nc", "--experiment", path), says, prepare)


ENTRIES |= {
    "experiment that is a folder": _elsewhere("x.yaml", "x.yaml", prepare=lambda f: (f / "x.yaml").mkdir()),
    "experiment that is nowhere": _elsewhere("x.yaml", "x.yaml: no such file"),
    "experiment behind a loop of links": _elsewhere("mine.yaml", "mine.yaml", prepare=_link("mine.yaml")),
    "experiment of 5000 characters": _elsewhere(
        "x" * 5000 + ".yaml", "--experiment" if False else "experiment", "too long"
    ),
    "experiment name of 5000 characters": _elsewhere("x" * 5000, "experiment"),
    "experiment that is a device": _elsewhere("mine.yaml", "mine.yaml", prepare=_link("/dev/zero")),
    "experiment outside": _elsewhere("../paper", "experiment: got '../paper'", "paper"),
    "experiment without name": _elsewhere("", "experiment: got ''"),
    "experiment that is a suffix": _elsewhere(".yaml", ".yaml", prepare=file(".yaml", GOOD)),
    "experiment of NUL": _elsewhere("a\0b.yaml", "experiment"),
}
