"""Where a large part is cut into chunks of whole beads, by a rule that knows the part alone, and what they share.

chunks = Chunking().chunks(job.targets, context.span)
chunks[0].firsts, chunks[0].stop
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slicing import Targets

from ..job.job import LARGE_PART, LEAST_CHUNK, WORTH_A_START, Job
from ..planning.context import Context, Span
from ..processes.worker_pool import WorkerPool, pool


@dataclass(frozen=True, eq=False)
class Shared:
    """What every chunk needs.

    Attributes:
        job: the part.
        context: what it is planned with.
    """

    job: Job
    context: Context

    @classmethod
    def of(cls, job: Job, context: Context) -> Shared:
        """Without what only reports ask for: it is sent to other processes."""
        return cls(replace(job, sliced=(), beads=()), context)


@dataclass(frozen=True)
class Chunk:
    """Beads that are planned one after the other.

    Attributes:
        firsts: first target of each.
        stop: one past the last target of the last.
    """

    firsts: tuple[int, ...]
    stop: int

    def __len__(self) -> int:
        """How many targets they have."""
        return self.stop - self.firsts[0]


@dataclass(frozen=True)
class Chunking:
    """How a part is cut.

    Attributes:
        whole: targets below which a part is one chunk.
        least: targets that a chunk has at least: it ends with the layer, or with a bead once it has twice as many.
    """

    whole: int = LARGE_PART
    least: int = LEAST_CHUNK

    def chunks(self, targets: Targets, span: Span) -> tuple[Chunk, ...]:
        """The chunks of a span of targets, in order.

        Args:
            targets: of the whole part.
            span: what of it is planned.

        Returns:
            One at least; the last takes over what would be too short for one of its own.
        """
        mine = slice(span.first, span.stop)
        begins = np.diff(targets.bead[mine], prepend=-1) != 0
        layer = np.stack([targets.sub_volume_index[mine], targets.layer[mine]])
        new_layer = (np.diff(layer, axis=1, prepend=-1) != 0).any(axis=0)
        firsts = np.flatnonzero(begins)
        count = span.stop - span.first
        cuts = [0]
        for i in firsts[1:].tolist() if count >= self.whole else ():
            since = i - cuts[-1]
            enough = self.least if new_layer[i] else 2 * self.least
            if since >= enough and count - i >= self.least:
                cuts.append(i)
        ends = [*cuts[1:], count]
        return tuple(
            Chunk(tuple((span.first + firsts[(firsts >= a) & (firsts < b)]).tolist()), span.first + b)
            for a, b in zip(cuts, ends, strict=True)
        )


USUAL = Chunking()


def pool_for_chunks(chunks: Sequence[Chunk]) -> WorkerPool:
    """The pool that works on chunks: new processes are started only where there is enough work for them.

    Args:
        chunks: of a part.
    """
    return pool(large=sum(map(len, chunks)) >= WORTH_A_START)
