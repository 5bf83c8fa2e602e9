# what the package exports: read by editors, type checkers, and the package itself
from .case.read import load_case as load_case
from .case.read import parse_case as parse_case
from .case.read import with_changes as with_changes
from .case.sections import Case as Case
from .compare.compare import compare_case as compare_case
from .compare.compare import compare_document as compare_document
from .compare.compare import compare_paper as compare_paper
from .errors import InputError as InputError
from .errors import WorkerKilledError as WorkerKilledError
from .failure import Failure as Failure
from .html.check_page import html_report as html_report
from .html.comparison_page import html_compare as html_compare
from .html.sweep_page import html_sweep as html_sweep
from .job.job import Job as Job
from .job.job import prepare as prepare
from .motion.motion import Motion as Motion
from .motion.motion_file import ReadMotion as ReadMotion
from .motion.motion_file import read_motion as read_motion
from .motion.motion_file import write_motion as write_motion
from .pose_sweep.grid import grid as grid
from .pose_sweep.ranking import sweep_document as sweep_document
from .pose_sweep.sweep import sweep as sweep
from .programs.cell_controller import cell_controller as cell_controller
from .programs.export import export_program as export_program
from .programs.exported.exported import Exported as Exported
from .programs.krl_read import read_krl as read_krl
from .programs.program_check import ProgramResult as ProgramResult
from .programs.program_check import check_program as check_program
from .remedy_search.search import Remedy as Remedy
from .remedy_search.search import remedies as remedies
from .report.check_document import report_document as report_document
from .report.motion_report import motion_document as motion_document
from .scene.compose import Scene as Scene
from .scene.compose import compose as compose
from .shipped import DEFAULT_CASE as DEFAULT_CASE
from .shipped import MODELS_DIR as MODELS_DIR
from .verdict.all_reasons import all_reasons as all_reasons
from .verdict.by_table_mode import check as check
from .verdict.failure_words import failure_in_words as failure_in_words
from .verdict.result import Result as Result
from .verdict.result import TargetVerdict as TargetVerdict
from .verification.motion_check import MotionResult as MotionResult
from .verification.motion_check import check_motion as check_motion
from .view.layer_picture import slice_picture as slice_picture
from .view.picture import picture as picture
from .view.sweep_map_picture import sweep_picture as sweep_picture

__all__ = [
    "DEFAULT_CASE",
    "MODELS_DIR",
    "Case",
    "Exported",
    "Failure",
    "InputError",
    "Job",
    "Motion",
    "MotionResult",
    "ProgramResult",
    "ReadMotion",
    "Remedy",
    "Result",
    "Scene",
    "TargetVerdict",
    "WorkerKilledError",
    "all_reasons",
    "cell_controller",
    "check",
    "check_motion",
    "check_program",
    "compare_case",
    "compare_document",
    "compare_paper",
    "compose",
    "export_program",
    "failure_in_words",
    "grid",
    "html_compare",
    "html_report",
    "html_sweep",
    "load_case",
    "motion_document",
    "parse_case",
    "picture",
    "prepare",
    "read_krl",
    "read_motion",
    "remedies",
    "report_document",
    "slice_picture",
    "sweep",
    "sweep_document",
    "sweep_picture",
    "with_changes",
    "write_motion",
]
