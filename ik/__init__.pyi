# what the package exports: read by editors, type checkers, and the package itself
from .chain import Chain as Chain
from .reachability_proof import certify as certify
from .roll import RollWindow as RollWindow
from .singularity import SingularityLimits as SingularityLimits
from .solver import Candidates as Candidates
from .solver import Solver as Solver

__all__ = [
    "Candidates",
    "Chain",
    "RollWindow",
    "SingularityLimits",
    "Solver",
    "certify",
]
