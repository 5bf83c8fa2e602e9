"""Figures that benches gave, kept in bench/figures/*.json: shown, or put into bench/README.md.

    python -m bench.figures ik           # the tables and notes of one bench
    python -m bench.figures --readme     # writes the table of bench/README.md

A document holds what was measured (question, command), against what (against, ratio, ratio_is; result where there is no
ratio), when and where (date, machine), the tables (caption, columns, rows), what a bench said (said), and notes.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
FOLDER, README = HERE / "figures", HERE / "README.md"
START, END = "<!-- figures -->", "<!-- end -->"


def documents() -> dict[str, dict[str, Any]]:
    """All figures, by the bench's name."""
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in sorted(FOLDER.glob("*.json"))}


def text_of(document: dict[str, Any]) -> str:
    """A document as it is kept: a row of a table a line."""
    rows = [row for table in document["tables"] for row in (table["columns"], *table["rows"])]
    marked = {**document, "tables": [{**t, "columns": "@", "rows": ["@"] * len(t["rows"])} for t in document["tables"]]}
    text = json.dumps(marked, indent=1, ensure_ascii=False)
    for row in rows:
        text = text.replace('"@"', json.dumps(row, ensure_ascii=False), 1)
    return text + "\n"


def table_of(columns: list[str], rows: list[list[Any]]) -> list[str]:
    """Rows as Markdown; columns of numbers to the right."""
    rule = ["--:" if all(isinstance(row[k], int | float) for row in rows) else "---" for k in range(len(columns))]
    return [f"| {' | '.join(map(str, cells))} |" for cells in (columns, rule, *rows)]


def shown(document: dict[str, Any]) -> str:
    """One bench's figures, to read."""
    lines = [f"{document['command']}: {document['about']}", f"{document['date']}, {document['machine']}", ""]
    for table in document["tables"]:
        lines += [*filter(None, [table["caption"]]), *table_of(table["columns"], table["rows"]), ""]
    lines += [*document.get("said", ()), "", *(f"- {note}" for note in document["notes"])]
    return "\n".join(lines)


def summary() -> str:
    """The table of bench/README.md."""
    rows = []
    for name, found in documents().items():
        what = f"{found['ratio']}: {found['ratio_is']}" if "ratio" in found else found["result"]
        rows.append([f"[`{name}.py`](figures/{name}.json)", found["question"], found["against"], what, found["date"]])
    return "\n".join(table_of(["bench", "of what", "against what", "ratio or result", "date"], rows))


def readme() -> str:
    """The page with its table made anew."""
    before, _, rest = README.read_text(encoding="utf-8").partition(START)
    return f"{before}{START}\n{summary()}\n{END}{rest.partition(END)[2]}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="?", choices=sorted(documents()), help="whose figures to show")
    parser.add_argument("--readme", action="store_true", help="write the table of bench/README.md")
    args = parser.parse_args()
    if args.readme:
        README.write_text(readme(), encoding="utf-8")
    elif args.name:
        print(shown(documents()[args.name]))
    else:
        print(summary())


if __name__ == "__main__":
    main()
