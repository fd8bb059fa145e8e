"""Pages of the site that are made of the repository: a hook of mkdocs.

The first page is the README and ``contributing.md`` is CONTRIBUTING.md, with their links; the gallery is made of the
catalogue and of the files that put its effects into equations, with the pictures of ``signatures.py``, the verdict's
page of its schema.
"""

import json
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import signatures
from mkdocs.structure.files import File

from emafault.diagnosis.forms import FORMS
from emafault.effects import EFFECTS
from emafault.equations.terms import TERMS
from emafault.reporting.written import SCHEMA_FILE

ROOT = Path(__file__).parents[1]
HERE = {"CONTRIBUTING.md": "contributing.md"}
#: a link to a file, not to a picture, an address or a heading of the same page
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\((?!https?:|#)([^)#\s]+)(#[^)]*)?\)")
#: a picture stands beside its own text alone, and above it where there is no room
STYLE = """<style>
.signature { float: right; width: 340px; margin: 0 0 1em 1em; background: white; }
@media (max-width: 44em) { .signature { float: none; display: block; width: 100%; margin: 0; } }
</style>
"""
CLEAR = '<div style="clear: both"></div>\n'
KINDS = {
    "structural": "Structure: what the nominal model lacks",
    "calibration": "Calibration: the unit outside its tolerance",
    "sensor": "Sensors",
}


def on_files(files, config):
    """Add the pages that are made."""
    pages = {
        "index.md": (ROOT / "README.md").read_text(),
        "contributing.md": (ROOT / "CONTRIBUTING.md").read_text(),
        "gallery.md": gallery(),
        "verdict.md": verdict(),
    }
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    for name, picture in pictures().items():
        files.append(File.generated(config, name, content=picture.svg))
    # pages that the navigation does not name stand at its end
    named = set(re.findall(r"[\w-]+\.md", json.dumps(config.nav)))
    rest = sorted(f.src_uri for f in files.documentation_pages() if f.src_uri not in named)
    if rest:
        config.nav.append({"More": rest})
    return files


def on_page_markdown(markdown, page, config, files):
    """Links as they hold in the repository, as they hold on the site; what is not on it is named and not linked."""
    there = {f.src_uri for f in files}

    def link(found: re.Match) -> str:
        text, target, anchor = found.groups(default="")
        path = re.sub(r"^(\.\./|docs/)", "", target)
        path = HERE.get(path, path)
        return f"[{text}]({path}{anchor})" if path in there else text

    return LINK.sub(link, markdown).replace("](docs/images/", "](images/")


@cache
def pictures() -> dict[str, signatures.Picture]:
    """Signatures of all effects and forms, by the name of the file."""
    effects = {f"signatures/{name}.svg": signatures.of_effect(name) for name in EFFECTS}
    return effects | {f"signatures/form_{name}.svg": signatures.of_form(name) for name in FORMS}


def gallery() -> str:
    """What the diagnosis knows: effects of the catalogue by kind, then the forms of what no catalogue lists."""
    out = [
        "# Effects and forms\n",
        STYLE,
        "What a diagnosis can name, and what it can describe, made of `conf/effect/`, `src/emafault/equations/terms/` "
        "and `src/emafault/diagnosis/forms/`. The signature is the term that an effect adds. The equations it acts in "
        "distinguish it from effects of other equations, its signature from those of the same equation. "
        "Where two look alike on given recordings, a verdict names the group.\n",
        "Each picture is what an effect adds to the residual of the nominal equation, measured less predicted, at half "
        "of the effect's realistic range. All are computed in one recording of the default actuator without noise, a "
        "sine of 1 Hz that reaches 157 rad/s in both directions. Points are rows of the equation, a line over them "
        "their medians. An effect of single phases has its full size in phase a, half of it in phase b (the other way, "
        "where there is one), none in phase c. How effects enter the simulation: "
        "[the actuator's equations](equations.md).\n",
    ]
    kinds = list(dict.fromkeys(e.kind for e in EFFECTS.values()))
    for kind in kinds:
        out.append(f"## {KINDS.get(kind, kind.capitalize())}\n")
        for effect in (e for e in EFFECTS.values() if e.kind == kind):
            out += _effect(effect)
    out.append("## Described forms: what no catalogue lists\n")
    for name, form in FORMS.items():
        file = f"signatures/form_{name}.svg"
        out.append(f"### {_words(name)}\n")
        out.append(_image(file))
        out.append(f"{_paragraph(form)}\n")
        out.append(f"**Told apart**: {pictures()[file].apart}\n")
        places = ", ".join(f"`{c}`" for c in form.CHANNELS) or "none"
        each = "in each recording by itself" if form.EACH else "the same in all recordings"
        out.append(
            f"Along {_words(form.ALONG).lower()}; its coefficients are {each}; channels that may have it: {places}. "
            f"Drawn as a torque, of the size of {pictures()[file].sizes}.\n"
        )
        out.append(CLEAR)
    return "\n".join(out)


def _effect(effect) -> Iterator[str]:
    term = TERMS[effect.id]
    source = (ROOT / "conf/effect" / f"{effect.id}.yaml").read_text().splitlines()[0].lstrip("# ")
    file = f"signatures/{effect.id}.svg"
    yield f"### {_words(effect.id)} {{ #{effect.id} }}\n"
    yield _image(file)
    yield f"{term.SENTENCE[0].upper()}{term.SENTENCE[1:]}. {_paragraph(term)}\n"
    yield f"**Signature** ({', '.join(_words(q).lower() for q in effect.equations)}): {source}\n"
    yield f"**Told apart**: {pictures()[file].apart} *Drawn for* {pictures()[file].sizes}.\n"
    yield CLEAR
    yield "| parameter | unit | nominal | from | to |\n|---|---|---|---|---|"
    for name, p in effect.parameters.items():
        yield f"| `{name}` | {p.units} | {p.nominal:g} | {p.low:g} | {p.high:g} |"
    yield ""


def _image(file: str) -> str:
    return f"![{pictures()[file].alt}]({file}){{ .signature loading=lazy }}\n"


def verdict() -> str:
    """Every field of ``diagnosis.json``."""
    schema = json.loads(SCHEMA_FILE.read_text())
    out = [
        "# The verdict file\n",
        f"`diagnosis.json` ({schema['title'].split(', ')[-1]}), the same for the reference actuator and for measured "
        "machines. It is checked against `src/emafault/reporting/verdict.schema.json` (JSON Schema) before it is "
        "written. `[]` stands for each entry of a list, `*` for each key.\n",
        "| field | type | accepted, or what it is | always there |\n|---|---|---|---|",
    ]
    for path, node, required in _fields(schema, schema["$defs"], ""):
        out.append(f"| `{path}` | {_type(node)} | {_accepted(node)} | {'yes' if required else ''} |")
    return "\n".join(out) + "\n"


def _fields(node: Mapping, defs: Mapping, path: str) -> Iterator[tuple[str, Mapping, bool]]:
    for name, child in node.get("properties", {}).items():
        child = _resolved(child, defs)
        here = f"{path}.{name}" if path else name
        yield here, child, name in node.get("required", ())
        yield from _fields(child, defs, here)
    for key, mark in (("items", "[]"), ("additionalProperties", ".*")):
        child = node.get(key)
        if isinstance(child, Mapping):
            child = _resolved(child, defs)
            if "properties" in child or isinstance(child.get("additionalProperties"), Mapping):
                yield from _fields(child, defs, f"{path}{mark}")


def _resolved(node: Mapping, defs: Mapping) -> Mapping:
    return defs[node["$ref"].rsplit("/", 1)[-1]] if "$ref" in node else node


def _type(node: Mapping) -> str:
    kind: Any = node.get("type", "string" if "enum" in node or "const" in node else "any")
    return " or ".join(kind) if isinstance(kind, list) else kind


def _accepted(node: Mapping) -> str:
    if "enum" in node:
        return ", ".join(f"`{x}`" for x in node["enum"])
    if "const" in node:
        return f"`{node['const']}`"
    if "minimum" in node:
        return f"{node['minimum']:g} to {node['maximum']:g}"
    return node.get("description", "")


def _words(name: str) -> str:
    return f"{name[0].upper()}{name[1:]}".replace("_", " ")


def _paragraph(module) -> str:
    """The first paragraph of a file's docstring."""
    return " ".join(module.__doc__.strip().split("\n\n")[0].split())
