"""Write docs/cases.md from the case file's own definition: ``python docs/make_case_reference.py``."""

from __future__ import annotations

import typing
from pathlib import Path

from pydantic.fields import FieldInfo

from cell import Case
from cell.case.fields import description_of, keys_of
from cell.case.problems import section_of

HEAD = """# Case files

A case file is a YAML file that holds everything of a run. Only `part` is needed; every other key has the default
shown. Lengths are in mm and angles in degrees, as each key says. Paths are relative to the file. Unknown keys are
errors. `docs/make_case_reference.py` makes this page from `cell/case/*sections.py` and `slicing/parameters.py`.

"""


def reference() -> str:
    """The whole page."""
    lines = [HEAD, "| key | default | meaning |\n| --- | --- | --- |\n"]
    _rows(Case, "", lines)
    return "".join(lines)


def _rows(section: type, prefix: str, lines: list[str]) -> None:
    for name, field in keys_of(section).items():
        inner = section_of(field.annotation)
        listed = "[]" if typing.get_origin(field.annotation) in (list, tuple) and inner else ""
        key = f"{prefix}{name}{listed}"
        meaning = description_of(field) or (_summary(inner) if inner else "")
        lines.append(f"| `{key}` | {_default(field, inner)} | {meaning} |\n")
        if inner is not None:
            _rows(inner, f"{key}.", lines)


def _summary(section: type) -> str:
    return (section.__doc__ or "").split("\n")[0]


def _default(field: FieldInfo, inner: type | None) -> str:
    if field.is_required():
        return "needed"
    value = field.get_default(call_default_factory=True)
    if inner is not None and isinstance(value, inner):
        return ""
    if value is None:
        return "none"
    text = str(list(value) if isinstance(value, tuple) else value)
    return f"`{text.lower() if isinstance(value, bool) else text}`"


if __name__ == "__main__":
    Path(__file__).with_name("cases.md").write_text(reference(), encoding="utf-8")
