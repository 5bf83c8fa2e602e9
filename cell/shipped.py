"""Where the shipped models and cases are.

Use:

    load_case(DEFAULT_CASE)                   # the propeller
"""

from __future__ import annotations

from pathlib import Path

_HERE = Path(__file__).resolve().parent
MODELS_DIR = _HERE / "models" if (_HERE / "models").is_dir() else _HERE.parent / "models"

DEFAULT_CASE = MODELS_DIR / "cases" / "propeller.case.yaml"


def is_path(model: str) -> bool:
    """Whether a model is a file rather than the name of a shipped one."""
    return "/" in model or "." in model
