"""Who looks at a part's table poses: workers, where the part is large enough for them to be worth their start.

found = crew_for(job).run(function, job, items)
"""

from __future__ import annotations

from ..job.job import Job
from ..processes.crew import Crew, crew

LARGE = 300  # targets from which on workers, whose start takes a second of each, save more than that


def crew_for(job: Job) -> Crew:
    """Those at work, for a large part; else nobody but this process.

    Args:
        job: the part.
    """
    return crew() if len(job.targets) >= LARGE else Crew(1)
