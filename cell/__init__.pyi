# what the package exports: read by editors, type checkers, and the package itself
from .case.read import load_case as load_case
from .case.read import parse_case as parse_case
from .case.sections import Case as Case
from .errors import InputError as InputError
from .failure import Failure as Failure
from .job.job import Job as Job
from .job.job import prepare as prepare
from .motion.motion import Motion as Motion
from .motion.motion_file import read_motion as read_motion
from .motion.motion_file import write_motion as write_motion
from .pose_sweep.grid import grid as grid
from .pose_sweep.sweep import sweep as sweep
from .remedy_search.search import Remedy as Remedy
from .remedy_search.search import remedies as remedies
from .report.check_document import report_document as report_document
from .report.motion_report import motion_document as motion_document
from .scene.compose import Scene as Scene
from .scene.compose import compose as compose
from .verdict.check import Result as Result
from .verdict.check import TargetVerdict as TargetVerdict
from .verdict.check import check as check
from .verification.motion_check import MotionResult as MotionResult
from .verification.motion_check import check_motion as check_motion

__all__ = [
    "Case",
    "Failure",
    "InputError",
    "Job",
    "Motion",
    "MotionResult",
    "Remedy",
    "Result",
    "Scene",
    "TargetVerdict",
    "check",
    "check_motion",
    "compose",
    "grid",
    "load_case",
    "motion_document",
    "parse_case",
    "prepare",
    "read_motion",
    "remedies",
    "report_document",
    "sweep",
    "write_motion",
]
