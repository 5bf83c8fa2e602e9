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


def test_cases_pass_and_fail_by_their_expectation(pytester, cases):
    """All in one run, as a user's folder of cases is: a process for each would take most of its time to import."""
    far = {"position_mm": [4000, 0, 0]}
    cases("good", expect="feasible")
    cases("far", positioner=far, expect="feasible")
    cases("told", positioner=far, expect={"verdict": "infeasible", "reasons": ["unreachable"]})
    cases("untold")
    cases("few", positioner=far, expect={"verdict": "infeasible", "infeasible": 1})
    cases("why", positioner=far, expect={"verdict": "infeasible", "reasons": {"collision": 3}})
    (pytester.path / "broken.case.yaml").write_text("prt: {}\nexpect: feasible\n")
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(passed=2, failed=4, skipped=1)
    for line in (
        "far.case.yaml: expected feasible, got infeasible (unreachable *",
        "few.case.yaml: expected 1 infeasible targets, got *",
        "why.case.yaml: expected collision 3, got 0*",
        "broken.case.yaml: *prt: unknown key; did you mean part?",
    ):
        result.stdout.fnmatch_lines([line])
