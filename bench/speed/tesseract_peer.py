"""Tesseract's Descartes planner, for ``bench/speed/tesseract.py``; run by the Python that has tesseract-robotics.

    python -m bench.speed.tesseract_peer FOLDER        # cell.urdf, cell.srdf, targets.npz

A line "FIRST STOP targets" or "FIRST STOP edges" on stdin is a bead to plan, free of collision at its targets
or between them too. Answers with a line of JSON; writes q_FIRST.npy. Only ``solve`` is timed, not making the program.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
from tesseract_robotics import tesseract_command_language as language
from tesseract_robotics import tesseract_motion_planners_descartes as descartes
from tesseract_robotics.tesseract_collision import CollisionEvaluatorType_LVS_DISCRETE
from tesseract_robotics.tesseract_common import FilesystemPath, GeneralResourceLocator, Isometry3d, ManipulatorInfo
from tesseract_robotics.tesseract_environment import Environment
from tesseract_robotics.tesseract_motion_planners import PlannerRequest

PLANNER = "DescartesMotionPlannerTask"
EDGE_STEP = float(np.deg2rad(1.0))  # rad between samples of an edge, as our own


def environment(folder: Path) -> tuple[Environment, GeneralResourceLocator]:
    """The cell; the locator has to outlive it."""
    locator, env = GeneralResourceLocator(), Environment()
    if not env.init(FilesystemPath(str(folder / "cell.urdf")), FilesystemPath(str(folder / "cell.srdf")), locator):
        raise SystemExit("Tesseract does not read the cell")
    return env, locator


def profiles(roll_step: float, clearance: float, edges: bool) -> tuple[language.ProfileDictionary, object]:
    """Roll about the tool's z at the same samples, collision at every vertex and, if asked for, along every edge."""
    profile = descartes.DescartesDefaultPlanProfileD()
    profile.target_pose_fixed = False
    profile.target_pose_sample_axis = np.array([0.0, 0.0, 1.0])
    profile.target_pose_sample_resolution = roll_step * (1 + 1e-9)
    profile.target_pose_sample_min = -np.pi
    profile.target_pose_sample_max = np.pi - roll_step  # a whole turn's end is its start
    profile.enable_collision, profile.allow_collision = True, False
    profile.enable_edge_collision = edges
    profile.use_redundant_joint_solutions = True  # A6 has more than a turn
    config = profile.vertex_collision_check_config
    config.contact_manager_config.margin_data.setDefaultCollisionMargin(clearance)
    profile.vertex_collision_check_config = config
    config = profile.edge_collision_check_config
    config.contact_manager_config.margin_data.setDefaultCollisionMargin(clearance)
    config.type = CollisionEvaluatorType_LVS_DISCRETE
    config.longest_valid_segment_length = EDGE_STEP
    profile.edge_collision_check_config = config
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
    step, clearance = float(given["roll_step"]), float(given["clearance"])
    kinds = {kind: profiles(step, clearance, kind == "edges") for kind in ("targets", "edges")}
    info = ManipulatorInfo()
    info.manipulator, info.manipulator_ik_solver = "manipulator", "OPWInvKin"
    info.tcp_frame, info.working_frame = "tcp", "base"
    planner = descartes.DescartesMotionPlannerD(PLANNER)
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        *bounds, kind = line.split()
        first, stop = (int(word) for word in bounds)
        request = PlannerRequest()
        request.env = env
        request.instructions = program(given["Ts"][first:stop], info)
        request.profiles = kinds[kind][0]
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
