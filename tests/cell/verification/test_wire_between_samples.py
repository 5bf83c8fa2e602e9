"""A wire that is drawn through metal between two samples, at neither of which it touches any."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, result_of

from cell.failure import CollisionPlace
from cell.verification.bead_samples import SampleSpacing, dense, rows_of
from cell.verification.collisions import _wire_collisions
from cell.verification.laid_deposits import LaidDeposits
from ik.closed_form import solve
from ik.spherical_wrist import recognise

BESIDE = 12e-3  # m that the wire is beside the boss before and after


@pytest.mark.parametrize("up", [0.0, 30e-3], ids=["through", "over"])
def test_between_two_samples_on_either_side_of_a_boss(tmp_path: Path, up: float) -> None:
    result = result_of(boss_case(tmp_path))
    job, m = result.job, result.motion
    chain = job.scene.chain
    rows = np.flatnonzero((m.bead == 0) & (m.arc == 1))
    tcp = chain.forward(m.q[rows])
    middle = tcp[:, :3, 3].mean(axis=0)
    a = int(np.argmax(np.linalg.norm(tcp[:, :3, 3] - tcp[0, :3, 3], axis=1)))
    across = rows[[0, a]]
    q = m.q[across].copy()
    for k, T in enumerate(chain.forward(q)):
        outward = (T[:3, 3] - middle) / np.linalg.norm(T[:3, 3] - middle)
        T[:3, 3] += BESIDE * outward - up * T[:3, 2]
        every = solve(recognise(chain), T[None])[0]
        off = np.abs((every - q[k] + np.pi) % (2 * np.pi) - np.pi).max(axis=1)
        best = int(np.nanargmin(off))
        q[k] += (every[best] - q[k] + np.pi) % (2 * np.pi) - np.pi
    last = int(np.flatnonzero(m.arc == 1)[-1])
    names = {name: getattr(m, name)[[last, last]] for name in ("table", "bead", "layer", "target")}
    moved = replace(m, t_s=np.array([0.0, 1.0]), q=q, arc=np.zeros(2, dtype=m.arc.dtype), **names)
    way = dense(job, moved, rows_of(job, moved), SampleSpacing(10.0, 10.0), np.ones(1, dtype=bool))
    assert len(way.q) == 2
    found = _wire_collisions(job, moved, way, LaidDeposits(*(np.full(k, job.scene.n_deposits) for k in (2, 1))))
    assert len(found) == (1 if up == 0.0 else 0)
    for hit in found:
        assert hit.failure.contact.seen is CollisionPlace.BETWEEN_ROWS
        assert any(name.startswith(("deposit/", "body/")) for name in hit.failure.pair)
