"""Slicing of sub-volumes on a round body: meshes in, layers, beads and robot targets out (part frame, mm).

Names are imported when they are first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
