"""Tesseract's Descartes planner on the beads of ``bench/tesseract.py``; run by the Python that has tesseract-robotics.

    python bench/tesseract_peer.py FOLDER        # cell.urdf, cell.srdf, targets.npz; a bead "first stop" a line on stdin

Answers each line with one line of JSON; writes q_FIRST.npy. Only ``solve`` is timed: not the program's making in Python.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
from tesseract_robotics import tesseract_command_language as language
from tesseract_robotics import tesseract_motion_planners_descartes as descartes
from tesseract_robotics.tesseract_common import FilesystemPath, GeneralResourceLocator, Isometry3d, ManipulatorInfo
from tesseract_robotics.tesseract_environment import Environment
from tesseract_robotics.tesseract_motion_planners import PlannerRequest

PLANNER = "DescartesMotionPlannerTask"


def environment(folder: Path) -> tuple[Environment, GeneralResourceLocator]:
    """The cell; the locator has to outlive it."""
    locator, env = GeneralResourceLocator(), Environment()
    if not env.init(FilesystemPath(str(folder / "cell.urdf")), FilesystemPath(str(folder / "cell.srdf")), locator):
        raise SystemExit("Tesseract does not read the cell")
    return env, locator


def profiles(roll_step: float, clearance: float) -> tuple[language.ProfileDictionary, object]:
    """Roll about the tool's z at the same samples, collision at every vertex."""
    profile = descartes.DescartesDefaultPlanProfileD()
    profile.target_pose_fixed = False
    profile.target_pose_sample_axis = np.array([0.0, 0.0, 1.0])
    profile.target_pose_sample_resolution = roll_step * (1 + 1e-9)
    profile.target_pose_sample_min = -np.pi
    profile.target_pose_sample_max = np.pi - roll_step  # a whole turn's end is its start
    profile.enable_collision, profile.allow_collision = True, False
    profile.enable_edge_collision = False
    profile.use_redundant_joint_solutions = True  # A6 has more than a turn
    config = profile.vertex_collision_check_config
    config.contact_manager_config.margin_data.setDefaultCollisionMargin(clearance)
    profile.vertex_collision_check_config = config
    out = language.ProfileDictionary()
    cast = descartes.cast_DescartesPlanProfileD(profile)
    out.addProfile(PLANNER, "BEAD", cast)
    return out, (profile, cast)


def program(Ts: np.ndarray, info: ManipulatorInfo) -> language.CompositeInstruction:
    """A bead as linear moves."""
    out = language.CompositeInstruction("BEAD")
    out.setManipulatorInfo(info)
    for T in Ts:
        waypoint = language.CartesianWaypointPoly_wrap_CartesianWaypoint(language.CartesianWaypoint(Isometry3d(T)))
        move = language.MoveInstruction(waypoint, language.MoveInstructionType_LINEAR, "BEAD", info)
        out.appendMoveInstruction(language.MoveInstructionPoly_wrap_MoveInstruction(move))
    return out


def main() -> None:
    """Serve beads until stdin ends."""
    folder = Path(sys.argv[1])
    given = np.load(folder / "targets.npz")
    env, _locator = environment(folder)
    dictionary, _kept = profiles(float(given["roll_step"]), float(given["clearance"]))
    info = ManipulatorInfo()
    info.manipulator, info.manipulator_ik_solver = "manipulator", "OPWInvKin"
    info.tcp_frame, info.working_frame = "tcp", "base"
    planner = descartes.DescartesMotionPlannerD(PLANNER)
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        first, stop = (int(word) for word in line.split())
        request = PlannerRequest()
        request.env = env
        request.instructions = program(given["Ts"][first:stop], info)
        request.profiles = dictionary
        wall, cpu = time.perf_counter(), time.process_time()
        response = planner.solve(request)
        spent = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
        found = bool(response.successful)
        if found:
            moves = [language.InstructionPoly_as_MoveInstructionPoly(i) for i in response.results.flatten()]
            states = [language.WaypointPoly_as_StateWaypointPoly(move.getWaypoint()) for move in moves]
            np.save(folder / f"q_{first}.npy", np.array([np.asarray(s.getPosition()).ravel() for s in states]))
        print(json.dumps({**spent, "found": found, "message": str(response.message)}), flush=True)


if __name__ == "__main__":
    main()
