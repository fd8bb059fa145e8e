"""What the workflow runs, as digests of sources, and the claim on where it writes."""

import ast
import fcntl
import functools
import hashlib
import json
from pathlib import Path
from typing import IO

from .errors import InputError
from .paths import EFFECTS, PACKAGE

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
    digest = hashlib.sha256("".join(seen[path] for path in sorted(seen)).encode())
    if PACKAGE / "effects" / "__init__.py" in seen:
        for path in sorted(EFFECTS.glob("*.yaml")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@functools.cache
def _read_source(path: Path) -> tuple[str, list[Path]]:
    """Digest of what a module means and the files of this package that it imports."""
    tree = ast.parse(path.read_bytes())
    imported = _imports(tree, path)
    return hashlib.sha256(_meaning(tree).encode()).hexdigest(), imported


def _meaning(tree: ast.AST) -> str:
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            value = body[0].value
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                body[0] = ast.Pass()
    return ast.dump(tree)


def _imports(tree: ast.AST, path: Path) -> list[Path]:
    """Files of this package that a module imports anywhere, its packages' own included."""
    dotted = ""
    if path.is_relative_to(PACKAGE):
        dotted = ".".join(("emafault", *path.relative_to(PACKAGE).with_suffix("").parts))
        dotted = dotted if path.name != "__init__.py" else dotted.removesuffix(".__init__") + "._"
    names = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parent = ".".join(dotted.split(".")[: -node.level]) if node.level else ""
            module = ".".join(part for part in (parent, node.module or "") if part)
            names += [module, *(f"{module}.{alias.name}" for alias in node.names)]
    found = []
    for name in names:
        words = name.split(".")
        if words[0] == "emafault":
            for depth in range(1, len(words) + 1):
                stem = PACKAGE.joinpath(*words[1:depth])
                found += [p for p in (stem / "__init__.py", stem.with_suffix(".py")) if p.is_file() and stem != p]
    return found
