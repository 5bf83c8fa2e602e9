"""The welding cell: scene, placement, collision, verdicts, reports and the command line.

Names are imported when they are first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
