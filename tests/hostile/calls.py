"""What stands behind ``snakemake --config``, and what must be named."""

LONG = "x" * 5000
CALLS: dict[str, tuple[dict, tuple[str, ...]]] = {
    "a key misspelt": ({"experimnt": "smoke"}, ("experimnt", "did you mean experiment", "overrides")),
    "a key of a group": ({"command": "sine"}, ("command", "experiment", "overrides")),
    "overrides a number": ({"overrides": 5}, ("overrides", "5")),
    "overrides a word": ({"overrides": "5"}, ("5",)),
    "overrides true": ({"overrides": True}, ("overrides", "True")),
    "overrides a mapping": ({"overrides": {"a": 1}}, ("overrides",)),
    "overrides of numbers": ({"overrides": [5]}, ("overrides",)),
    "overrides unclosed": ({"overrides": "'"}, ("overrides", "quotation")),
    "overrides of NUL": ({"overrides": "a\0=1"}, ("override", "x00")),
    "override twice": ({"overrides": "command=sine command=ramp"}, ("command",)),
    "experiment a number": ({"experiment": 5}, ("experiment", "5")),
    "experiment a list": ({"experiment": ["paper"]}, ("experiment",)),
    "experiment empty": ({"experiment": ""}, ("experiment", "''")),
    "experiment null": ({"experiment": None}, ("experiment", "None")),
    "experiment unknown": ({"experiment": "nothing"}, ("experiment", "'nothing'", "smoke")),
    "experiment too long": ({"experiment": LONG + ".yaml"}, ("experiment", "too long")),
    "twin unknown": ({"twin": "magic"}, ("twin", "'magic'", "friction_axis")),
    "twin a list": ({"twin": ["a"]}, ("twin",)),
    "twin nowhere": ({"twin": "nowhere.py"}, ("nowhere.py",)),
    "bench nowhere": ({"bench": "nowhere"}, ("bench", "nowhere")),
    "bench too long": ({"bench": LONG}, ("bench", "too long")),
    "bench a list": ({"bench": ["a", "b"]}, ("bench",)),
    "bench of NUL": ({"bench": "a\0b"}, ("bench", "NUL")),
}
