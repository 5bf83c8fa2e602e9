"""The verdict on a case with its table as the case asks for it: standing, indexing, moving, or at the best pose found.

    result = check(prepare(case))                          # as `rbam check` does
    result = check(prepare(case), E1_deg=90, E2_deg=180)   # the table stands there

Angles of the table in degrees.
"""

from __future__ import annotations

from numbers import Real

from ..case.sections import Case
from ..errors import InputError
from ..job.job import Job, prepare
from ..processes.worker_pool import working
from ..progress import Progress
from .check import check_fixed
from .result import Result


def check(
    job: Job,
    E1_deg: float | None = None,
    E2_deg: float | None = None,
    *,
    processes: int = 1,
    progress: Progress | None = None,
) -> Result:
    """Check every target, every bead and the travels between them, as ``rbam check`` does.

    Without angles the table does what the case's ``table.mode`` says. With both it stands at them.

    Args:
        job: from ``cell.prepare``.
        E1_deg: tilt of the table, deg; left out, as is ``E2_deg``: as the case asks.
        E2_deg: turn of the table, deg; a whole turn is added or subtracted if only that lies in the axis' range.
        processes: number of processes for a large part; the verdict does not depend on it. With more than one
            the calling script needs ``if __name__ == "__main__":``, as with ``multiprocessing``.
        progress: a function that is called with what is counted, how many are done, and of how many.

    Returns:
        The verdict.

    Raises:
        InputError: there is no job, only one angle is given, or it is not a finite number, or the table of the case
            does not stand at one given pose; the positioner has no such angles, or cannot move like that; one line.
        WorkerKilledError: a worker process was killed from outside; one line.
    """
    if not isinstance(job, Job):
        raise InputError(f"check takes a job, not a {type(job).__name__}; cell.prepare makes one of a case")
    asked = _pose_of(job.case, E1_deg, E2_deg)
    with working(processes):
        return _checked(job, progress) if asked is None else check_fixed(job, *asked, progress)


def prepare_and_check(case: Case, progress: Progress | None = None, *, processes: int = 1) -> Result:
    """Prepare and check a case: of a large part the processes begin while its cell is composed.

    Args:
        case: the case.
        progress: called with how far it is.
        processes: as of :func:`check`.

    Returns:
        The verdict.

    Raises:
        InputError: as of ``cell.prepare`` and :func:`check`.
    """
    with working(processes):
        return check(prepare(case), progress=progress)


def _pose_of(case: Case, E1_deg: float | None, E2_deg: float | None) -> tuple[float, float] | None:
    """The pose that is given; None where none is.

    Raises:
        InputError: half a pose, no numbers, or a table that does not stand at one given pose.
    """
    if E1_deg is None and E2_deg is None:
        return None
    if E1_deg is None or E2_deg is None:
        missing, other = ("E1_deg", "E2_deg") if E1_deg is None else ("E2_deg", "E1_deg")
        raise InputError(f"{missing}: is missing beside {other}; give both angles, or none for the table of the case")
    pose = _finite("E1_deg", E1_deg), _finite("E2_deg", E2_deg)
    mode = case.table.mode
    if mode != "fixed":
        raise InputError(
            f"E1_deg, E2_deg: do not go with table mode {mode}, which has poses of its own; leave them out, or set "
            f'table={{"mode": "fixed"}} with cell.with_changes'
        )
    return pose


def _finite(name: str, value: object) -> float:
    """An angle as a float.

    Raises:
        InputError: it is no number, or not a finite one.
    """
    wrong = InputError(f"{name}: {value!r} is not an angle; a finite number in degrees is needed")
    if isinstance(value, bool) or not isinstance(value, Real):
        raise wrong
    try:
        angle = float(value)
    except OverflowError:
        raise wrong from None
    if not abs(angle) < float("inf"):
        raise wrong
    return angle


def _checked(job: Job, progress: Progress | None) -> Result:
    """The verdict as the case asks for it."""
    table = job.case.table
    if table.mode == "fixed":
        return check_fixed(job, table.E1_deg, table.E2_deg, progress)
    # what moves the table is imported where it moves
    if table.mode == "indexed":
        from .indexed import check_indexed

        return check_indexed(job, progress)
    if table.mode == "best":
        from .best_pose import check_best

        return check_best(job, progress)
    from .coordinated import check_coordinated

    return check_coordinated(job, progress)
