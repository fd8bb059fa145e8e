"""What the workflow runs, as digests of sources, and the claim on where it writes."""

import ast
import contextlib
import fcntl
import functools
import hashlib
import json
import sys
from pathlib import Path
from typing import IO, Any

from .errors import InputError
from .io.atomic import write_text
from .paths import CACHE, EFFECTS, PACKAGE

_KNOWN = CACHE / "sources.json"  # digest of a source's bytes -> what it means and imports, since parsing takes seconds
_MOST = 5000  # sources that are kept
_claims: list[IO[str]] = []  # held as long as the process lives


def claim(folder: str | Path) -> None:
    """Claim a folder of results for this process; a killed process leaves no claim behind, unlike a lock file.

    Raises
    ------
    InputError : another process is at work there
    """
    Path(folder).mkdir(parents=True, exist_ok=True)
    file = open(Path(folder) / ".lock", "w")
    _claims.append(file)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(f"{folder}: another run is at work there, wait until it has ended") from None


def digest_of(*values: object) -> str:
    """Digest of plain values, the same for the same ones."""
    return hashlib.sha256(json.dumps(values, sort_keys=True, default=str).encode()).hexdigest()[:16]


def file_digest(path: str | Path) -> str:
    """Digest of what a file holds."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


@functools.cache
def source_digest(script: str | Path) -> str:
    """Digest of a script and of every module of this package that it imports, directly or not.

    Comments, docstrings and layout do not count. Where the catalogue of effects is imported, its files count.
    """
    pending, seen = [Path(script)], {}
    while pending:
        path = pending.pop()
        if path not in seen:
            seen[path], imported = _read_source(path)
            pending += imported
    ordered = sorted(seen, key=lambda path: (not path.is_relative_to(PACKAGE), path))  # wherever the script is
    digest = hashlib.sha256("".join(seen[path] for path in ordered).encode())
    if PACKAGE / "effects" / "__init__.py" in seen:
        for path in sorted(EFFECTS.glob("*.yaml")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@functools.cache
def _read_source(path: Path) -> tuple[str, list[Path]]:
    """Digest of what a module means and the files of this package that it imports."""
    source, known = path.read_bytes(), _known_sources()
    key = hashlib.sha256(f"{sys.version_info}{_dotted(path)}\0".encode() + source).hexdigest()
    if key not in known:
        tree = ast.parse(source)
        names = sorted({name for name in _imports(tree, path) if name.split(".")[0] == "emafault"})
        known[key] = [hashlib.sha256(_meaning(tree).encode()).hexdigest(), names]
    digest, names = known[key]
    return digest, [file for name in names for file in _files(name)]


@functools.cache
def _known_sources() -> dict[str, list[Any]]:
    """What was parsed before."""
    try:
        read = json.loads(_KNOWN.read_text())
        return read if isinstance(read, dict) else {}
    except (OSError, ValueError):
        return {}


def keep_known_sources() -> None:
    """Keep what was parsed for the next call; what cannot be kept is parsed again."""
    with contextlib.suppress(InputError):
        write_text(_KNOWN, json.dumps(dict(list(_known_sources().items())[-_MOST:])))


def _meaning(tree: ast.AST) -> str:
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            value = body[0].value
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                body[0] = ast.Pass()
    return ast.dump(tree)


def _dotted(path: Path) -> str:
    """The name of a module of this package, by which it resolves relative imports; of a script nothing."""
    if not path.is_relative_to(PACKAGE):
        return ""
    dotted = ".".join(("emafault", *path.relative_to(PACKAGE).with_suffix("").parts))
    return dotted if path.name != "__init__.py" else dotted.removesuffix(".__init__") + "._"


def _imports(tree: ast.AST, path: Path) -> list[str]:
    """Names that a module imports anywhere, those of this package in full."""
    dotted = _dotted(path)
    names = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parent = ".".join(dotted.split(".")[: -node.level]) if node.level else ""
            module = ".".join(part for part in (parent, node.module or "") if part)
            names += [module, *(f"{module}.{alias.name}" for alias in node.names)]
    return names


@functools.cache
def _files(name: str) -> list[Path]:
    """Files of this package that importing a name reads, its packages' own included."""
    found, words = [], name.split(".")
    for depth in range(1, len(words) + 1):
        stem = PACKAGE.joinpath(*words[1:depth])
        found += [p for p in (stem / "__init__.py", stem.with_suffix(".py")) if p.is_file() and stem != p]
    return found
