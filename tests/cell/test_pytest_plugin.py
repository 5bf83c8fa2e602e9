"""The pytest plugin that runs case files."""

import pytest


@pytest.fixture
def cases(pytester, make_case, tmp_path):
    """A folder of a user's cases, with what they need."""
    pytester.makeconftest("")

    def add(name, **sections):
        path = make_case(name, **sections)
        for source in (path, tmp_path / "boss.stl"):
            (pytester.path / source.name).write_bytes(source.read_bytes())

    return add


def run(pytester):
    return pytester.runpytest_subprocess("-p", "no:cacheprovider")


def test_cases_pass_and_fail_by_their_expectation(pytester, cases):
    cases("good", expect="feasible")
    cases("far", positioner={"position_mm": [4000, 0, 0]}, expect="feasible")
    cases(
        "told", positioner={"position_mm": [4000, 0, 0]}, expect={"verdict": "infeasible", "reasons": ["unreachable"]}
    )
    cases("untold")
    result = run(pytester)
    result.assert_outcomes(passed=2, failed=1, skipped=1)
    result.stdout.fnmatch_lines(["far.case.yaml: expected feasible, got infeasible (unreachable *"])


def test_counts_and_reasons_are_held(pytester, cases):
    far = {"position_mm": [4000, 0, 0]}
    cases("few", positioner=far, expect={"verdict": "infeasible", "infeasible": 1})
    cases("why", positioner=far, expect={"verdict": "infeasible", "reasons": {"collision": 3}})
    result = run(pytester)
    result.assert_outcomes(failed=2)
    result.stdout.fnmatch_lines(["few.case.yaml: expected 1 infeasible targets, got *"])
    result.stdout.fnmatch_lines(["why.case.yaml: expected collision 3, got 0*"])


def test_a_broken_case_fails_in_one_line(pytester):
    (pytester.path / "broken.case.yaml").write_text("prt: {}\nexpect: feasible\n")
    result = run(pytester)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["broken.case.yaml: *prt: unknown key; did you mean part?"])
