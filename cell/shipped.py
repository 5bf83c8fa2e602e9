"""Where the shipped models and cases are.

Use:

    load_case(DEFAULT_CASE)                   # the propeller
    case_path("boiler")                       # a shipped case by its name
"""

from __future__ import annotations

from pathlib import Path

_HERE = Path(__file__).resolve().parent
MODELS_DIR = _HERE / "models" if (_HERE / "models").is_dir() else _HERE.parent / "models"

CASE_FILE = ".case.yaml"
DEFAULT_CASE = MODELS_DIR / "cases" / "propeller.case.yaml"


def is_path(model: str) -> bool:
    """Whether a model is a file rather than the name of a shipped one."""
    return "/" in model or "." in model


def case_path(case: str | Path) -> Path:
    """Where a case is: the file, or the shipped case of that name where there is no such file.

    Args:
        case: a path, or a name such as propeller_indexed.
    """
    path = Path(case)
    if is_path(str(case)) or path.exists():
        return path
    shipped = MODELS_DIR / "cases" / f"{case}{CASE_FILE}"
    return shipped if shipped.is_file() else path


def shipped_cases() -> list[str]:
    """The names of the shipped cases."""
    return sorted(path.name.removesuffix(CASE_FILE) for path in (MODELS_DIR / "cases").glob(f"*{CASE_FILE}"))
