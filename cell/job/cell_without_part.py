"""A cell without a part, in which a program is checked whose part is not known.

    job = bare_job(load_case("cell.case.yaml"))       # part: none
    len(job.targets), job.scene.n_deposits            # 0, 0

Programs without a part are checked against the cell alone.
"""

from __future__ import annotations

import numpy as np

from slicing import Code, PartShape, Targets, Warning

from ..case.sections import Case
from ..scene.compose import compose
from .job import Job, margin_warnings

PART_ABSENT_TEXT = (
    "part: none: beads, their order and speed, the growing part and the angle to gravity are not checked; "
    "joint limits, speeds, singularities with the arc on and collisions in the cell are"
)


def bare_job(case: Case) -> Job:
    """A cell without a part.

    Args:
        case: with ``part: none``.

    Returns:
        A job without targets.

    Raises:
        InputError: something in the case cannot be used; one line.
    """
    scene = compose(case, PartShape({}, {}, (), 0))
    whole, none = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    targets = Targets((), whole, whole, whole, none, none, none, np.zeros(0), np.zeros(0, dtype=bool))
    warnings = (Warning(Code.PART_ABSENT, PART_ABSENT_TEXT), *scene.warnings)
    job = Job(case, (), PartShape({}, {}, (), 0), targets, scene, warnings)
    job = Job(case, (), job.shape, targets, scene, (*warnings, *margin_warnings(job.solver)))
    _ = job.drives  # computed here so that an error in them comes first
    return job
