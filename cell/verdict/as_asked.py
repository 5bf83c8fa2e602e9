"""The verdict on a case with its table as the case asks for it: standing, indexing, or the best pose found.

result = check_as_asked(prepare(case))
result.feasible, result.asked
"""

from __future__ import annotations

from ..case.sections import Case
from ..job.job import Job, prepare
from ..processes.crew import working
from ..progress import Progress
from .check import check
from .result import Result


def check_as_asked(job: Job, progress: Progress | None = None, *, jobs: int = 1) -> Result:
    """Check a job with the table as its case has it.

    Args:
        job: from ``cell.job.job.prepare``.
        progress: told how far it is.
        jobs: processes that a large part is shared out among; the verdict does not depend on it.

    Returns:
        The verdict.

    Raises:
        InputError: the positioner has no such angles, or cannot move like that, or a worker was killed; one line.
    """
    with working(jobs):
        return _checked(job, progress)


def prepare_and_check(case: Case, progress: Progress | None = None, *, jobs: int = 1) -> Result:
    """Prepare and check a case: of a large part the processes begin while its cell is composed.

    Args:
        case: the case.
        progress: told how far it is.
        jobs: as of :func:`check_as_asked`.

    Returns:
        The verdict.

    Raises:
        InputError: as of :func:`cell.job.job.prepare` and :func:`check_as_asked`.
    """
    with working(jobs):
        return check_as_asked(prepare(case), progress)


def _checked(job: Job, progress: Progress | None) -> Result:
    table = job.case.table
    if table.mode == "fixed":
        return check(job, table.E1_deg, table.E2_deg, progress)
    # what moves the table is imported where it moves
    if table.mode == "indexed":
        from .indexed import check_indexed

        return check_indexed(job, progress)
    if table.mode == "best":
        from .best_pose import check_best

        return check_best(job, progress)
    from .coordinated import check_coordinated

    return check_coordinated(job, progress)
