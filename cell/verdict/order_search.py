"""The order in which layers are built on a table that indexes, and the poses that suit the sub-volumes.

search = OrderSearch(job)
search.runs()             # the order with the shortest turns; `cell.job.reordered` builds the job in it
search.learned(result)    # of that job: True where it shows further layers that lock others out
"""

from __future__ import annotations

import numpy as np

from ..job.build_order import LayerRun
from ..job.job import Job
from ..job.table_groups import TableGroup, table_groups
from ..job.table_section_check import BODY
from ..processes.worker import Tick
from ..table_poses.layer_order import shortest_order
from ..table_poses.layer_precedence import locked_layers
from ..table_poses.parallel_poses import pool_for_poses
from ..table_poses.suited_poses import SuitedPose, suited_poses, upright_poses
from ..table_poses.table_turn import nearest_turn, turn_time
from .result import Result


def _suited(job: Job, group: TableGroup, _: Tick) -> list[SuitedPose]:
    """The poses that suit a group."""
    return suited_poses(job, group)


class OrderSearch:
    """Poses that suit the sub-volumes of a job, and orders of their layers that may be free.

    Attributes:
        suited: poses of each sub-volume by its name, best first.
        needs: which layers of others may be there at each layer, see ``cell.table_poses.layer_precedence``.
        seconds: the table's turn from each sub-volume's pose to each other's, (s, s), s.
    """

    def __init__(self, job: Job) -> None:
        """Find poses, and the layers that lock others out at them."""
        self.job = job
        groups = {group.sub_volume: group for group in table_groups(job)}
        found = pool_for_poses(job).run(_suited, job, list(groups.values()))
        self.suited = dict(zip(groups, found, strict=True))
        lost = any(not suited for suited in self.suited.values())
        for name, group in groups.items():
            if not self.suited[name]:  # nothing can hold: the most upright one says why
                poses, band = upright_poses(job, group)
                self.suited[name] = [SuitedPose(int(band[0]), 0, (float(poses[0][0]), float(poses[0][1])))]
        best = [self.suited[name][0].pose if name in groups else None for name in job.targets.sub_volume]
        # a part that is lost whatever comes first is not checked for what locks out what
        self.needs = locked_layers(job, [None] * len(best) if lost else best)
        at = [pose or (0.0, 0.0) for pose in best]
        self.seconds = np.array([[turn_time(job, a, nearest_turn(job.scene, b, a)) for b in at] for a in at])

    def runs(self) -> list[LayerRun]:
        """The order to try next."""
        layers = self.job.layers
        fixed = int(self.job.targets.sub_volume[0] == BODY)
        natural = [(k, 0, count - 1) for k, count in enumerate(layers)]
        return shortest_order(layers, self.seconds, self.needs, fixed) or natural

    def learned(self, result: Result) -> bool:
        """Take note of layers that lock out others in a result; whether there are any that were not known."""
        t, names = result.job.targets, list(self.job.targets.sub_volume)
        new = False
        for i, row in enumerate(result.rows):
            own, layer = int(t.sub_volume_index[i]), int(t.layer[i])
            for other in () if row.failure is None else row.failure.locked_by:
                a = names.index(other.sub_volume)
                if a != own and other.layer < self.needs[own][layer, a]:
                    self.needs[own][layer, a], new = other.layer, True
        return new
