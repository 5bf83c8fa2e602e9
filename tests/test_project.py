"""Rules of the project itself: who imports whom, and documents that are made from code."""

import ast
import runpy

from support.paths import ROOT
from support.source_trees import tree_of

from bench import figures, run_smoke
from bench.soundness.weakenings import MUTANTS

PACKAGES = ("cell", "ik", "slicing")


def test_the_case_reference_is_up_to_date():
    made = runpy.run_path(str(ROOT / "docs" / "make_case_reference.py"))["reference"]()
    assert (ROOT / "docs" / "cases.md").read_text(encoding="utf-8") == made


def test_every_key_of_a_case_says_what_it_means():
    rows = [line.split("|") for line in (ROOT / "docs" / "cases.md").read_text(encoding="utf-8").splitlines()[9:]]
    keys = {row[1].strip(): row[3].strip() for row in rows if len(row) > 3}
    assert len(keys) > 200
    assert [key for key, meaning in keys.items() if not meaning] == []


def test_every_public_name_has_a_docstring_with_a_module_example():
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            assert ast.get_docstring(tree_of(path)), path


def test_every_mutant_stands_once_in_the_code():
    assert len(MUTANTS) >= 25
    for mutant in MUTANTS:
        assert (ROOT / mutant.module).read_text(encoding="utf-8").count(mutant.text) == 1, mutant
        assert all((ROOT / "tests" / name).is_file() for name in mutant.tests), mutant


def test_the_benches_figures_are_up_to_date_in_their_readme():
    assert figures.readme() == (ROOT / "bench" / "README.md").read_text(encoding="utf-8")
    for name, document in figures.documents().items():
        assert (ROOT / "bench" / "figures" / f"{name}.json").read_text(encoding="utf-8") == figures.text_of(document)
        assert len(list((ROOT / "bench").glob(f"*/{name}.py"))) == 1
        assert {"date", "machine", "against"} <= set(document)
        assert "ratio" in document or "result" in document


def test_every_bench_has_a_smoke_run():
    for path in run_smoke.benches():
        assert "parsed(" in (text := path.read_text(encoding="utf-8")) or '"--smoke"' in text, path
