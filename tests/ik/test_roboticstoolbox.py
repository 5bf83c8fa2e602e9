"""The solvers against roboticstoolbox: another library's kinematics and its Levenberg-Marquardt, on the same arm."""

import numpy as np
import pytest
from support.cells.arms import replaced, sampled, welder
from support.oracles.toolbox import links_of

from ik.closed_form import solve as closed_form
from ik.dls import solve as damped
from ik.roll import RollWindow, wrap
from ik.spherical_wrist import recognise


@pytest.fixture(scope="module")
def arm():
    """The shipped arm with its torch, A6 within half a turn of zero, as the toolbox knows no whole turns."""
    chain = welder()
    return replaced(chain, lower=np.maximum(chain.lower, -np.pi), upper=np.minimum(chain.upper, np.pi))


@pytest.fixture(scope="module")
def toolbox(arm):
    pytest.importorskip("roboticstoolbox", reason="needs roboticstoolbox-python")
    return links_of(arm).compile()


def test_forward_is_the_toolboxs(arm, toolbox):
    q = sampled(arm, 300, seed=5)
    theirs = np.array([np.asarray(toolbox.eval(row)) for row in q])
    np.testing.assert_allclose(arm.forward(q), theirs, atol=1e-9)


def test_what_levenberg_marquardt_finds_the_closed_form_and_damped_least_squares_find(arm, toolbox):
    Ts = arm.forward(sampled(arm, 150, seed=6, inside=0.05))
    theirs = [toolbox.ik_LM(T, slimit=16, tol=1e-12) for T in Ts]
    found = np.array([bool(answer.success) for answer in theirs])
    assert found.mean() > 0.9
    q = np.array([answer.q for answer in theirs])[found]
    branches = closed_form(recognise(arm), Ts[found])
    off = np.nanmin(np.abs(wrap(branches - q[:, None])).max(axis=-1), axis=1)
    # at its tolerance, and near a singularity less sharply
    assert np.quantile(off, 0.95) < 1e-4
    assert off.max() < 1e-2
    ours = damped(arm, Ts[found], RollWindow.fixed(0.0), enough=1)
    assert ours.ok.any(axis=1).mean() > 0.98
