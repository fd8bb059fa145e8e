"""Plain files of settings and results: JSON and YAML, refused by name where they are not whole."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from .errors import InputError, one_line, shown
from .places import file_at

LARGEST = 10_000_000  # bytes of a YAML file of settings; more is another kind of file
DEEPEST, MOST = 40, 100_000  # levels and values of a YAML file


def read_json(path: str | Path, *needed: str) -> Any:
    """Read JSON; where keys are needed, a mapping that has them.

    Raises
    ------
    InputError : no such file, not whole JSON, or a needed key is missing
    """
    text = _text(path)
    try:
        read = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{shown(path)}: not JSON ({error})") from error
    for key in needed:
        if not isinstance(read, dict) or key not in read:
            raise InputError(f"{shown(path)}: lacks '{key}', accepted is a mapping with {', '.join(needed)}")
    return read


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Read a mapping in YAML, of one document, plain values and keys that stand once; what is not written is ``???``.

    Interpolations stay as they are written.

    Raises
    ------
    InputError : no such file, or not such a mapping, with the line where YAML says one
    """
    import yaml
    from omegaconf import OmegaConf
    from omegaconf.errors import OmegaConfBaseException

    text = _text(path)
    if len(text) > LARGEST:
        raise InputError(f"{shown(path)}: is larger than settings are")
    try:
        root = yaml.compose(text, yaml.SafeLoader)
        if not isinstance(root, yaml.MappingNode):
            raise InputError(f"{shown(path)}: accepted is a mapping of keys to values")
        _refuse_unfolding(path, root)
        loaded = OmegaConf.create(text)
        read: Any = OmegaConf.to_container(loaded)
    except yaml.MarkedYAMLError as error:
        where = f", line {error.problem_mark.line + 1}" if error.problem_mark else ""
        problem = ": ".join(part for part in (error.context, error.problem) if part)
        raise InputError(f"{shown(path)}{where}: is not YAML that is accepted ({problem})") from error
    except InputError:
        raise
    except (yaml.YAMLError, OmegaConfBaseException, ValueError, RecursionError) as error:
        raise InputError(f"{shown(path)}: is not YAML that is accepted ({one_line(error)[:300]})") from error
    if not read:
        raise InputError(f"{shown(path)}: holds nothing, accepted is a mapping of keys to values")
    for key in read:
        if not isinstance(key, str):
            raise InputError(f"{shown(path)}: {key!r}: there is no such key; keys are words")
    return read


def array(value: Any, key: str, shape: tuple[int | None, ...] | None = None) -> np.ndarray:
    """Nested lists of finite numbers as an array.

    Parameters
    ----------
    key : what messages name
    shape : that it must have, None for any length; left out any shape is accepted

    Raises
    ------
    InputError : not numbers, ragged, not finite, or of another shape
    """
    try:
        out = np.array(value)
    except ValueError as error:
        raise InputError(f"{key}: got lists of different lengths, accepted is an array of numbers") from error
    if out.dtype.kind not in "iuf" or not np.all(np.isfinite(out)):
        raise InputError(f"{key}: got {shown(value)}, accepted are finite numbers")
    if shape is not None and (
        out.ndim != len(shape) or any(n not in (None, have) for n, have in zip(shape, out.shape))
    ):
        accepted = " x ".join("any" if n is None else str(n) for n in shape)
        raise InputError(f"{key}: has shape {out.shape}, accepted is {accepted}")
    return out.astype(float)


def escaped(text: str) -> str:
    """Text that stays as it is where OmegaConf would look up ``${...}``."""
    return re.sub(r"(\\*)\$\{", lambda found: 2 * found[1] + r"\${", text)


def _refuse_unfolding(path: str | Path, root: Any) -> None:
    """Refuse what unfolds without end, or too far: a few lines of aliases can stand for gigabytes."""
    pending: list[tuple[Any, tuple[int, ...]]] = [(root, ())]
    seen = 0
    while pending:
        node, above = pending.pop()
        seen += 1
        if id(node) in above or len(above) > DEEPEST or seen > MOST:
            raise InputError(f"{shown(path)}: holds itself, or unfolds to more than {DEEPEST} levels or {MOST} values")
        for child in node.value if isinstance(getattr(node, "value", None), list) else ():
            pending += [(part, (*above, id(node))) for part in (child if isinstance(child, tuple) else (child,))]


def _text(path: str | Path) -> str:
    try:
        return file_at(path).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{shown(path)}: is not text in UTF-8 ({error.reason} at byte {error.start})") from error
    except OSError as error:
        raise InputError(f"{shown(path)}: cannot be read ({error.strerror})") from error
