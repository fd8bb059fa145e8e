"""The section of the report that shows what retraining with the named effect has brought."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

RETRAINED = "retrained.json"


def section(folder: Path, verdict: Mapping[str, Any]) -> str:
    """HTML of the section; empty where nothing was retrained for this very verdict."""
    try:
        found = json.loads((folder / RETRAINED).read_text())
    except (OSError, ValueError):
        return ""
    return "" if found.get("digest") != verdict["digest"] else found.get("html", "")
