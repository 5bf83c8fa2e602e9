"""Memory that has been freed, given back to the system.

    del spec                                  # hundreds of MB, in many small pieces
    give_back()

The allocator of glibc keeps what is freed in small pieces for later, and takes what is large from the system all the
same: a process that once needed much in small pieces stays that large. Elsewhere there is nothing to do.
"""

from __future__ import annotations

import ctypes
import sys


def give_back() -> None:
    """Give back to the system what the process has freed; takes some milliseconds."""
    if sys.platform != "linux":
        return
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # not in every C library
    if trim is not None:
        trim(0)
