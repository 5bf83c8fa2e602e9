"""pytest plugin: every ``*.case.yaml`` with an ``expect:`` is a test.

Installed with the package, so that plain ``pytest`` in a folder of cases runs them all::

    # blade.case.yaml
    expect: feasible                       # or infeasible, or
    expect: {verdict: infeasible, infeasible: 148, reasons: {joint_limit: 148}}
    expect: {verdict: infeasible, reasons: [joint_limit, collision]}

A case without ``expect:`` is skipped, with that as the reason. Switch the plugin off with ``-p no:rbam``.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from .case.sections import Expect
    from .verdict.result import Result


class Unexpected(Exception):
    """A case came out differently; the message says how."""


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect case files."""
    if file_path.name.endswith(".case.yaml"):
        return CaseFile.from_parent(parent, path=file_path)
    return None


class CaseFile(pytest.File):
    """A case file; holds one test."""

    def collect(self) -> Iterator[pytest.Item]:
        """The case's one test, named after the file."""
        yield CaseItem.from_parent(self, name=self.path.name.removesuffix(".case.yaml"))


class CaseItem(pytest.Item):
    """Checks a case and compares the verdict with what the case expects."""

    def runtest(self) -> None:
        """Run ``rbam check`` and compare.

        Raises:
            Unexpected: the verdict, a count or a reason differs.
        """
        from .case.read import load_case
        from .job.job import prepare
        from .verdict.by_table_mode import check

        case = load_case(self.path)
        if case.expect is None:
            pytest.skip("the case has no expect:")
        result = check(prepare(case))
        problems = list(differences(case.expect, result))
        if problems:
            raise Unexpected("; ".join(problems))

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """One line for what a user can mend, pytest's own report for a bug."""
        from .errors import InputError

        if isinstance(excinfo.value, Unexpected | InputError):
            return f"{self.path.name}: {excinfo.value}"
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Where it stands, for pytest's lines."""
        return self.path, 0, f"case: {self.name}"


def differences(expect: Expect, result: Result) -> Iterator[str]:
    """What came out differently from what was expected.

    Args:
        expect: the case's expectation.
        result: the verdict.

    Yields:
        A sentence each.
    """
    verdict = "feasible" if result.feasible else "infeasible"
    counts = {reason: k for reason, k in result.reasons.items() if k}
    if verdict != expect.verdict:
        why = ", ".join(f"{reason} {k}" for reason, k in counts.items())
        yield f"expected {expect.verdict}, got {verdict}" + (f" ({why})" if why else "")
    if expect.infeasible is not None and expect.infeasible != result.infeasible:
        yield f"expected {expect.infeasible} infeasible targets, got {result.infeasible}"
    if isinstance(expect.reasons, dict):
        for reason, k in expect.reasons.items():
            if counts.get(reason, 0) != k:
                yield f"expected {reason} {k}, got {counts.get(reason, 0)}"
    elif expect.reasons is not None and set(expect.reasons) != set(counts):
        yield f"expected reasons {', '.join(sorted(expect.reasons))}, got {', '.join(sorted(counts)) or 'none'}"
