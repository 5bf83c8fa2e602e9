"""Our arms in roboticstoolbox's terms, as a peer to measure and to test against.

links = links_of(chain).compile()          # a ModuleNotFoundError where roboticstoolbox-python is not installed
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ik import Chain


def links_of(chain: Chain) -> Any:
    """An arm with its tool as a sequence of elementary transforms (roboticstoolbox's ETS), m and rad."""
    import roboticstoolbox as rtb
    from spatialmath import SE3

    links = rtb.ETS()
    for j in range(chain.n):
        # a turn about any axis as a turn about z between two fixed frames
        frame = np.eye(4)
        x = np.cross(np.eye(3)[int(np.argmin(np.abs(chain.axes[j])))], chain.axes[j])
        x /= np.linalg.norm(x)
        frame[:3, :3] = np.column_stack([x, np.cross(chain.axes[j], x), chain.axes[j]])
        limits = [chain.lower[j], chain.upper[j]]
        links *= rtb.ET.SE3(SE3(chain.origins[j] @ frame, check=False)) * rtb.ET.Rz(jindex=j, qlim=limits)
        links *= rtb.ET.SE3(SE3(frame.T, check=False))
    return links * rtb.ET.SE3(SE3(chain.T_last_tcp, check=False))
