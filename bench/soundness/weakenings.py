"""Weakenings of what is proved or checked: what ``mutants.py`` puts in, one at a time, and the tests that must notice."""

# ruff: noqa: E501  (texts as they stand in the code)

from __future__ import annotations

from dataclasses import dataclass

BOUNDS, DETECTION, OWN = (
    "cell/collision/proofs/test_bounds.py",
    "cell/mjcf/test_detection.py",
    "acceptance/test_own_motion.py",
)
ROUNDINGS = "cell/collision/test_blend_proofs.py"
SHEETS = "cell/collision/test_blend_sheets.py"
ROUNDED, TIMES = "cell/collision/test_blended_corners.py", "cell/timing/test_time_law.py"
STRAIGHT, METAL = "cell/planning/travels/test_straight_travels.py", "cell/job/test_wire_in_metal.py"
HOME = "cell/planning/travels/test_home.py"
COVERS = "cell/collision/proofs/test_laid_covers.py"
GROUPS, PLANES = "cell/collision/test_pair_groups.py", "cell/collision/proofs/test_plane_proofs.py"
# of a row that comes to lie too near: the steps beside it are reported all the same
AT_ITS_END = (
    "clearances at a step's ends differ by the way between them at most: where one is below the limit they cannot add up"
    " to more than the way beyond it, so that the step stays unproved and is reported; only its pair is told more exactly"
)
NEAR = "acceptance/test_near_misses.py"
HITS, COUPLED = "cell/verification/test_broken_motions.py", "cell/collision/proofs/test_coupled_bounds.py"
LIMITS, ACCELERATIONS = "cell/verification/test_limits_of_motions.py", "cell/verification/test_accelerations.py"
PROOFS, DEVIATION = "ik/test_reachability_proof.py", "ik/test_near_spherical_wrist.py"
SURFACES = "slicing/surfaces/test_surfaces.py"
CUTS = "cell/planning/test_bead_cut.py"
STEPS, BORDERS = "cell/planning/test_steps_of_motions.py", "slicing/volume/test_borders.py"
BY_MODE, GIVEN = "cell/verdict/test_by_table_mode.py", "cell/motion/test_given_motion.py"
EXPORTED = "cell/programs/exported/test_exported_files.py"
CREW = "cell/processes/test_worker_pool.py"
INNER = "cell/programs/krl/test_inner_calls.py"
AHEAD = "cell/part_chunks/test_runs_ahead.py"
PROGRAMS, OVERHANG = "cell/programs/test_program_findings.py", "cell/job/test_overhang_check.py"


@dataclass(frozen=True)
class Mutant:
    """A weakening.

    Attributes:
        module: path of the file.
        text: what is replaced; stands there once.
        by: what takes its place.
        tests: files of tests that must notice, one of them at least.
        equivalent: why no verdict changes, where it is argued that none does: such a one may survive.
    """

    module: str
    text: str
    by: str
    tests: tuple[str, ...]
    equivalent: str = ""


MUTANTS = (
    # bounds
    Mutant("cell/collision/proofs/reach_radii.py", " - anchors[i]) + model.geom_rbound[g]", " - anchors[i])", (BOUNDS,)),
    Mutant("cell/collision/proofs/between_samples.py", "room <= joint_travel_bound(radius, a, b)", "room <= 0.2 * joint_travel_bound(radius, a, b)", (BOUNDS,)),
    Mutant("cell/collision/proofs/between_samples.py", "room[k] <= checker.travel_bound(radius, a[k], b[k])", "room[k] <= 0.5 * checker.travel_bound(radius, a[k], b[k])", (BOUNDS,)),
    Mutant("cell/collision/proofs/between_samples.py", "return left, np.concatenate(hits)", "return left[:0], np.concatenate(hits)", (BOUNDS,)),
    Mutant("cell/collision/proofs/between_samples.py", "motion[steps.step[hit]])", "motion[steps.step[:1]])", (BOUNDS,)),
    Mutant("cell/collision/proofs/open_steps.py", "return self.da + self.db - 2 * limit", "return self.da + self.db - limit", (BOUNDS,)),
    Mutant("cell/collision/proofs/between_samples.py", "if seen.distance[k] < nearest.best.distance[0]:", "if False:", (BOUNDS,)),
    Mutant("cell/collision/proofs/motion_bounds.py", " + chord[:, self._joint] * self._size", "", (BOUNDS,)),
    Mutant("cell/collision/pair_groups.py", "switched.geom_conaffinity[arm] = 0", "switched.geom_conaffinity[~arm] = 0", (GROUPS,)),
    Mutant("cell/collision/pair_groups.py", "self.pair_gap = 0.0", "self.pair_gap = -1e3", (GROUPS,)),
    Mutant("cell/collision/proofs/motion_bounds.py", "np.minimum(joints, parts * (straight", "np.minimum(joints, 1 * (straight", (BOUNDS,)),
    Mutant("cell/collision/proofs/motion_bounds.py", "parts * (straight + curvature(self.radius, np.abs(b - a)) / 4)", "parts * straight", (BOUNDS,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "np.minimum(value - off, carried)", "np.minimum(value, carried)", (PLANES,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "travel = share * self._links.travel(", "travel = 0.5 * self._links.travel(", (PLANES,)),
    Mutant("cell/collision/wire.py", "self._size + self.reach + SLACK", "self._size + SLACK", ("cell/collision/test_wire.py",)),
    Mutant("cell/collision/wire.py", "turn, box = np.abs(data.geom_xmat[part].reshape(-1, 3, 3))", "turn, box = 0 * np.abs(data.geom_xmat[part].reshape(-1, 3, 3))", ("cell/collision/test_wire.py",)),
    Mutant("cell/collision/proofs/link_poses.py", "        away += turned[self.joint] * self.size[:, None]\n", "", (PLANES,)),
    Mutant("cell/collision/proofs/link_poses.py", "turned, turned) / 2.0)", "turned, turned) / 8.0)", (PLANES,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "np.full(len(look.travel), -np.inf), np", "np.full(len(look.travel), np.inf), np", (PLANES,)),
    Mutant("cell/collision/proofs/shared_planes.py", "np.maximum.at(offset, leader[shares], under[shares])", "offset[leader] = under[leader]", (PLANES,)),
    Mutant("cell/collision/proofs/shared_planes.py", "np.flatnonzero(new | ~shares)", "np.flatnonzero(new)", (PLANES,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "near.distance - most[near.row] >= wanted", "near.distance >= wanted", (PLANES,)),
    Mutant("cell/collision/proofs/shared_planes.py", "            off[:, link] -= poses.places_of(frame[link], sample[link])\n", "", (PLANES,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "measured = away + OFF", "measured = 0.5 * away + OFF", (PLANES,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "away + OFF_PARABOLA * change_of_curvature(self._radius, turn)", "away", (PLANES,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "np.minimum.at(carried, within[held[1]], held[2] - LESS)", "pass", (PLANES,)),
    Mutant("cell/collision/proofs/laid_covers.py", "middle + grown * corners", "middle + corners", (COVERS,)),
    Mutant("cell/collision/proofs/laid_covers.py", "        middle = points[mine].mean(axis=0)", "        middle = (points.min(axis=0) + points.max(axis=0)) / 2", (COVERS,)),
    Mutant("cell/collision/proofs/laid_covers.py", "        beyond[mine] = np.inf\n", "", (COVERS,)),
    Mutant("cell/collision/proofs/laid_covers.py", "np.concatenate([self.points, later])", "later", (COVERS,)),
    Mutant("cell/collision/proofs/laid_covers.py", "later = np.concatenate([self.later, points])", "later = points", (COVERS,)),
    Mutant("cell/collision/proofs/laid_covers.py", "np.concatenate([self.hull.points, self.later])", "self.hull.points", (COVERS,)),
    Mutant("cell/collision/proofs/laid_covers.py", "_laid[k][number - 1]", "_laid[k][max(number - 2, 0)]", (COVERS,)),
    Mutant("cell/collision/proofs/covered_pairs.py", "gap -= links.reach(cover, tried)", "gap += links.reach(cover, -tried)", (COVERS,)),
    Mutant("cell/collision/proofs/covered_pairs.py", "far - size[:, None] - shape.size < need", "far - size[:, None] < need", (COVERS,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "others.joined(covered_pairs(self._links, poses, clusters, seen, far))", "others", (COVERS,)),
    Mutant("cell/collision/proofs/carried_planes.py", "above[which] - below - bent[which]", "above[which] - below", (PLANES,)),
    Mutant("cell/collision/proofs/carried_planes.py", "out[mine] = moved + turned + ", "out[mine] = moved + ", (PLANES,)),
    Mutant("cell/collision/proofs/step_clusters.py", "begins = np.append(0, np.flatnonzero(np.diff(laid[order])) + 1)[: len(order)]", "begins = np.zeros(1, dtype=np.int64)", (PLANES,)),
    Mutant("cell/collision/proofs/step_clusters.py", "(np.diff(cluster) == 0) & (np.diff(sorted_step) == 1)", "np.diff(sorted_step) == 1", (PLANES,)),
    Mutant("cell/collision/proofs/convex_shapes.py", "        out = out + self.ball\n", "", (PLANES,)),
    Mutant("cell/collision/proofs/convex_shapes.py", "out += self.disc * np.sqrt", "out += 0.5 * self.disc * np.sqrt", (PLANES,)),
    Mutant("cell/collision/proofs/motion_clearance.py", "closed = left[~np.isin(part, part[bad])]", "closed = left[~np.isin(left, left[bad])]", (PLANES,)),
    Mutant("cell/collision/blended_corners.py", "np.maximum.at(off, p.row, p.off)\n    close", "np.maximum.at(off, p.row, 0.1 * p.off)\n    close", (BOUNDS,)),
    Mutant("cell/collision/blended_corners.py", "here = away[at].max(axis=1) + ", "here = 0.2 * away[at].max(axis=1) + ", (ROUNDED,)),
    Mutant("cell/planning/edges/densify.py", "asked = np.stack([halves, halves + 1], axis=1)", "asked = np.stack([halves, halves], axis=1)", ("cell/planning/edges/test_densify.py",)),
    Mutant("cell/planning/edges/densify.py", "kept=more.kept - off)", "kept=more.kept)", ("cell/planning/edges/test_densify.py",)),
    Mutant("cell/timing/time_law.py", "uneven = low < EVEN * high", "uneven = low < 0", (TIMES,)),
    Mutant("cell/collision/proofs/motion_bounds.py", "seen = np.maximum(seen, straight + curvature(radius,", "seen = np.maximum(0.5 * seen, 0.5 * straight + curvature(radius,", (COUPLED,)),
    Mutant("cell/collision/proofs/motion_bounds.py", " + curvature(radius, np.concatenate([outer, turn[:, :n]], axis=1)) / 4)", ")", (COUPLED,)),
    Mutant("cell/collision/proofs/motion_bounds.py", "return np.maximum(arm, np.minimum(joints, seen))", "return arm", (COUPLED,)),
    Mutant("cell/collision/proofs/motion_bounds.py", "return np.maximum(arm, np.minimum(joints, seen))", "return np.minimum(joints, seen)", (COUPLED,)),
    Mutant("cell/collision/blended_corners.py", "joint_travel_bound(radius, q[:-1], q[1:]) + 2 * sagitta)", "joint_travel_bound(radius, q[:-1], q[1:]))", (ROUNDED,)),
    Mutant("cell/collision/blended_corners.py", "checker.travel_bound(radius, q[k], q[k + 1]) + 2 * sagitta[k]]", "checker.travel_bound(radius, q[k], q[k + 1])]", (ROUNDED,)),
    Mutant("cell/collision/blended_corners.py", "checker.travel_bound(radius, a[k], b[k]) + 2 * sagitta[k]\n", "checker.travel_bound(radius, a[k], b[k]) + sagitta[k]\n", (ROUNDED,)),
    Mutant("cell/collision/blended_corners.py", "joint_travel_bound(radius, a, b) + 2 * sagitta) &", "joint_travel_bound(radius, a, b)) &", (ROUNDED,)),
    Mutant("cell/collision/blended_corners.py", 'np.searchsorted(p.s, high, side="left"), first + 1, len(p.bend))', "first + 1, first + 1, len(p.bend))", (ROUNDED,)),
    Mutant("cell/collision/blend_chords.py", "thick = _Nearer(checker, off)", "thick = _Nearer(checker, 0.0)", (ROUNDED,)),
    Mutant("cell/collision/blend_chords.py", "= low[steps] - off, low[steps + 1] - off", "= low[steps], low[steps + 1]", (ROUNDED,)),
    Mutant("cell/collision/blend_chords.py", "    if sagitta <= off:\n", "    if True:\n", (ROUNDED,)),
    Mutant("cell/collision/blended_corners.py", "return np.unique(np.concatenate([*lost, of]))", "return np.unique(of)", (BOUNDS,)),
    Mutant("cell/collision/blend_proofs.py", "** 2 / (4 * self.zone)", "** 2 / (8 * self.zone)", (ROUNDINGS,)),
    Mutant("cell/collision/blend_proofs.py", "aside = np.abs(sums", "aside = 0 * np.abs(sums", (ROUNDINGS,)),
    Mutant("cell/collision/blend_proofs.py", "(known.kept[left] - most[left] >= least)", "(known.kept[left] >= least)", (ROUNDINGS,)),
    Mutant("cell/collision/blend_proofs.py", "way + corners.off(radius, path.s[row] + inwards)", "0 * way + corners.off(radius, path.s[row] + inwards)", (ROUNDINGS, BOUNDS)),
    Mutant("cell/collision/blend_proofs.py", "(differs <= room) & (laid[step].min(axis=1) >= laid[steps[some]])", "differs <= room", (ROUNDINGS,)),
    Mutant("cell/collision/blend_proofs.py", "np.ptp(aside, axis=1).sum(axis=1)", "0.3 * np.ptp(aside, axis=1).sum(axis=1)", (ROUNDINGS,)),
    Mutant("cell/collision/blend_bisection.py", "far += ((some.v - some.u) ** 2", "far += 0 * ((some.v - some.u) ** 2", (ROUNDINGS,)),
    Mutant("cell/collision/blend_bisection.py", "way += checker.bend_bound(radius, np.abs(one)) + np.abs(one + across) @ radius", "way = 0.5 * way", (ROUNDINGS,)),
    Mutant("cell/collision/blend_bisection.py", "return middle, way + most, way > most", "return middle, way, way > most", (ROUNDINGS,)),
    Mutant("cell/collision/blend_sheets.py", "(slopes + changes)", "slopes", (SHEETS,)),
    Mutant("cell/collision/blend_sheets.py", "du**2 / 2 * by_length", "du**2 / 4 * by_length", (SHEETS,)),
    Mutant("cell/collision/blend_sheets.py", "dz**2 / 2 * by_zone]", "dz**2 / 6 * by_zone]", (SHEETS,)),
    Mutant("cell/collision/blend_sheets.py", "        speed_z += dz * by_zone + du * most\n", "", (SHEETS,)),
    Mutant("cell/collision/blend_sheets.py", "off <= room[left]", "off <= np.inf", (SHEETS,)),
    Mutant("cell/collision/blend_sheets.py", "| (np.diff(laid) != 0)", "", (SHEETS,)),
    Mutant("cell/collision/blend_sheets.py", "            proved &= (s[one.steps + 1] <= u) | (s[one.steps] >= v)\n", "            pass\n", (SHEETS,)),
    Mutant("cell/collision/proofs/sheet_pieces.py", " + curved / 8)", ")", (SHEETS,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "value[of].min(axis=1) - off)", "value[of].max(axis=1))", (SHEETS,)),
    Mutant("cell/collision/proofs/motion_bounds.py", "return parts * curvature(self.radius, turn)", "return 0.25 * parts * curvature(self.radius, turn)", (ROUNDINGS,)),
    Mutant("cell/collision/pair_groups.py", "self.moving = 2 if itself else 1", "self.moving = 1", (ROUNDINGS,)),
    Mutant("cell/collision/blended_corners.py", "low = known - joint_travel_bound(radius, path.q, q)", "low = known", (BOUNDS,)),
    Mutant("cell/collision/blended_corners.py", "hit = np.flatnonzero(seen.distance < least)", "hit = np.flatnonzero(seen.distance < -1)", (BOUNDS, ROUNDED), AT_ITS_END),
    Mutant("cell/planning/assemble.py", "        if not _dwell(job, before, first):\n", "        if True:\n", (BOUNDS,)),
    Mutant("cell/collision/proofs/reach_radii.py", "[joint[axis]]) + model.geom_rbound[g])", "[joint[axis]]))", (BOUNDS,)),
    # collision detection
    Mutant("cell/mjcf/detection.py", "int(disable.mjDSBL_MULTICCD)", "0", (DETECTION,)),
    Mutant("cell/mjcf/detection.py", "ITERATIONS = 200", "ITERATIONS = 35", (DETECTION,)),
    Mutant("cell/mjcf/detection.py", "        if geom.type == GEOM.mjGEOM_BOX:\n", "        if False:\n", (DETECTION,)),
    Mutant("cell/collision/checker.py", "            self._far = -1.0  # somebody", "            # somebody", ("cell/collision/test_model_copies.py",)),
    Mutant("cell/collision/checker.py", "np.multiply(self._hard, far / 2,", "np.multiply(self._hard, far / 4,", (DETECTION, "cell/collision/test_clearances.py")),
    Mutant("cell/collision/checker.py", "if far == self._far:", "if self._far >= 0:", ("cell/collision/test_clearances.py",)),
    Mutant("cell/collision/checker.py", "if now != before:", "if before is None:", (DETECTION, "cell/collision/test_clearances.py")),
    Mutant("cell/collision/checker.py", "(scene.deposit_of_geom < deposits_laid)", "(scene.deposit_of_geom < deposits_laid - 1)", (DETECTION, "cell/collision/test_clearances.py")),
    Mutant("cell/collision/model_copies.py", "self.model: mujoco.MjModel = copy.copy(model)", "self.model: mujoco.MjModel = model", ("cell/collision/test_model_copies.py", "cell/collision/test_shared_scene.py")),
    Mutant("cell/collision/model_copies.py", "mine = spare.pop()", "mine = spare[-1]", ("cell/collision/test_model_copies.py", "cell/collision/test_shared_scene.py")),
    Mutant("cell/collision/broad_phase.py", "room <= reach", "room <= 0.0", ("cell/collision/test_clearances.py",)),
    Mutant("cell/collision/checker.py", "self._data.geom_xpos[self._away] = self._places_away", "pass", ("cell/collision/test_model_copies.py",)),
    Mutant("cell/mjcf/convex_pieces.py", "yield (thin[:, None] + 4 * slack * CORNERS).reshape(-1, 3)", "pass", ("cell/mjcf/test_convex_pieces.py",)),
    Mutant("cell/mjcf/convex_pieces.py", "return parts if all(part.volume() > 0 for part in parts) else [solid]", "return parts", ("cell/mjcf/test_convex_pieces.py",)),
    Mutant("cell/mjcf/asset_files.py", "if nested or not at.is_file():", "if not at.is_file():", ("cell/mjcf/test_asset_files.py",)),
    # verification
    Mutant("cell/verification/collisions.py", "stretches_of(clear.distance < least,", "stretches_of(clear.distance < 0,", (HITS, "cell/verification/test_motion_check.py")),
    Mutant("cell/verification/arm_clearances.py", "steps = [piece.first + seen", "steps = [0 * piece.first + seen", (NEAR,)),
    Mutant("cell/verification/arm_clearances.py", "if a <= run.low < run.high <= b)", "if a <= run.low < run.high < b)", ("cell/verification/test_long_motions.py",)),
    Mutant("cell/verification/arm_clearances.py", "unproven_steps(checker, radius, q, deposits_laid, clear, least=least)", "unproven_steps(checker, radius, q, deposits_laid, clear)", (NEAR,)),
    Mutant("cell/verification/collisions.py", "*_wire_collisions(job, motion, sampled, deposits_laid), ", "", (HITS,)),
    Mutant("cell/verification/drive_use.py", "SPEED_SLACK = 1.001", "SPEED_SLACK = 1.2", ("cell/verification/test_motion_check.py", HITS)),
    Mutant("cell/verification/bead_order.py", "if behind.max() > _tolerance(job):", "if False:", ("cell/verification/test_motion_check.py", HITS)),
    Mutant("cell/verification/bead_samples.py", "named_score <= best + 1", "named_score <= best", (OWN,)),
    # timing
    Mutant("cell/planning/assemble.py", "np.maximum(dt[1:], TICK)", "dt[1:]", ("cell/planning/test_assemble.py",)),
    Mutant("cell/timing/greatest_speeds.py", "np.concatenate([bend, bend])", "np.concatenate([0 * bend, bend])", (TIMES,)),
    Mutant("cell/timing/greatest_speeds.py", "x[:-1] * self._by_x <= 1.0", "x[:-1] * self._by_x <= 3.0", (TIMES,)),
    Mutant("cell/timing/greatest_speeds.py", "(top * self._by_x > 1.0)", "(top * self._by_x > 3.0)", (TIMES,)),
    Mutant("cell/timing/time_grid.py", "np.concatenate([-corners, corners, 2 * s[-1] - corners])", "corners", (TIMES,)),
    Mutant("cell/timing/time_grid.py", "CORNER = 0.005", "CORNER = 0.5", (TIMES,)),
    Mutant("cell/timing/greatest_speeds.py", "    limit[ends - 1] = 0.0\n", "    limit[-1] = 0.0\n", (TIMES,)),
    Mutant("cell/timing/greatest_speeds.py", "beta[np.append(0, ends[:-1])] = 0.0", "beta[0] = 0.0", (TIMES,)),
    Mutant("cell/timing/greatest_speeds.py", "v = min([a * v", "v = max([a * v", (TIMES,)),
    Mutant("cell/timing/greatest_speeds.py", "2 * step, max_acceleration[:, None]", "2 * step, 1.2 * max_acceleration[:, None]", (TIMES,)),
    # planning
    Mutant("cell/planning/edges/densify.py", "        failures.update(found)\n    return stretch", "    return stretch", ("cell/planning/edges/test_densify.py",)),
    Mutant("cell/planning/edges/edge_check.py", "        elif least[e] < context.settings.clearance:\n", "        elif least[e] < 0:\n", ("cell/verdict/test_check.py", "cell/planning/test_station_search.py"), AT_ITS_END),
    Mutant("cell/planning/travels/travel.py", "    step, nearest = unproven_steps(context.checker, context.radius, q, laid, found, least=context.settings.kept)\n", "    step, nearest = unproven_steps(context.checker, context.radius, q, laid, found, least=-1.0)\n", (NEAR,)),
    Mutant("cell/planning/travels/straight_travels.py", "    good[of[found.distance < room]] = False\n", "", (STRAIGHT,)),
    Mutant("cell/planning/travels/straight_travels.py", "        good[of[k[step]]] = False\n", "", (STRAIGHT,)),
    Mutant("cell/planning/travels/straight_travels.py", "path if is_clear else None", "path", (STRAIGHT,)),
    Mutant("cell/planning/beads_ahead.py", "if beads[0].whole and known.gap.start is beads[0].stretches[0]:", "if known.gap.start is not None:", (HOME,)),
    Mutant("cell/planning/beads_ahead.py", "if beads[-1].whole and known.gap.end is beads[-1].stretches[0]:", "if known.gap.end is not None:", (HOME,)),
    Mutant("cell/planning/travels/home.py", "path is not None and np.array_equal(path.q[row], stretch.axes[at])", "path is not None", (HOME,)),
    Mutant("cell/planning/beads_ahead.py", "BeadGap(beads[-1].stretches[0], None, int(self._context.laid[span.stop - 1]))", "BeadGap(beads[-1].stretches[0], None, 0)", (HOME,)),
    Mutant("cell/planning/travels/straight_travels.py", "left[of[step[proved.kept < room]]] = True", "pass", (STRAIGHT,)),
    Mutant("cell/planning/travels/straight_travels.py", "np.append(-np.inf, kept[:-1])", "np.append(np.inf, kept[:-1])", (STRAIGHT,)),
    Mutant("cell/planning/travels/travel.py", "kept_on_steps(low, q, radius)", "np.append(low[:-1], -np.inf)", (STRAIGHT,)),
    Mutant("cell/job/wire_in_metal.py", "~away | (off <= OUTSIDE_MM)", "off <= OUTSIDE_MM", (METAL,)),
    Mutant("cell/job/wire_in_metal.py", "~away | (off <= OUTSIDE_MM)", "~away", (METAL,)),
    Mutant("cell/cli/main.py", "    _refuse_empty(args)\n", "", ("cell/cli/test_exit_codes.py",)),
    Mutant("cell/job/wire_in_metal.py", "corners = support.radius_mm / np.cos(np.pi / SUPPORT_SIDES)", "corners = support.radius_mm", (METAL,)),
    Mutant("cell/collision/proofs/plane_proofs.py", "clusters.laid, far), far, travel, within)", "clusters.laid, far), 2 * far, travel, within)", (PLANES,)),
    # slicing
    Mutant("slicing/volume/solid_flux.py", "/ 3", "/ 3.03", ("slicing/volume/test_solid_flux.py", "slicing/volume/test_layer_areas.py")),
    Mutant("slicing/volume/layer_areas.py", "4.0 * ends[1]", "3.9 * ends[1]", ("slicing/volume/test_layer_areas.py",)),
    Mutant("slicing/layers/thickness.py", "np.minimum(to_below, to_body)", "to_below", ("slicing/strategies/test_planar_layers.py", "slicing/curves/test_analytic_sections.py")),
    Mutant("slicing/surfaces/cylinders.py", "inner**2 + half * half", "inner**2", (SURFACES,)),
    Mutant("slicing/surfaces/cylinders.py", "math.sqrt(square) + apart", "math.sqrt(square) + 2.0 * apart", (SURFACES,)),
    Mutant("slicing/surfaces/cylinders.py", "            return 0.0  # the axis passes through a face\n", "            pass\n", (SURFACES,)),
    Mutant("slicing/surfaces/planes.py", "away / math.cos(turn)", "away", (SURFACES,)),
    Mutant("slicing/surfaces/bodies.py", "low[0] <= ON_AXIS_MM, high[0] <= ON_AXIS_MM", "high[0] <= ON_AXIS_MM, low[0] <= ON_AXIS_MM", ("slicing/surfaces/test_bodies.py",)),
    Mutant("slicing/surfaces/charts.py", "float(part.area * self.spacing_share(at, np.array([[0.0, 1.0]]))[0])", "float(part.area)", ("slicing/surfaces/test_charts.py",)),
    Mutant("slicing/surfaces/pole_chart.py", "np.diff(up_to) / self.longer(", "np.diff(up_to) * self.longer(", ("slicing/surfaces/test_charts.py",)),
    Mutant("slicing/beads/regions.py", "(0, 1, -1) if chart.turn_mm else (0,)", "(0,)", ("slicing/beads/test_infill.py", "slicing/beads/test_fill.py")),
    # motions and programs held against their limits, ways of the table, proofs of reach, lost parts
    Mutant("cell/verification/motion_check.py", "        *_gravity_findings(job, fine, on),\n", "", (LIMITS,)),
    Mutant("cell/verification/motion_check.py", "        *_hanging_findings(job, motion),\n", "", (OVERHANG,)),
    Mutant("cell/verification/motion_check.py", "        *skips(fine, on, motion.bead[fine.row]),\n", "", (LIMITS,)),
    Mutant("cell/verification/motion_check.py", "over = np.maximum(lower - q, q - upper)", "over = lower - q", (LIMITS,)),
    Mutant("cell/verification/motion_check.py", "    hits += table_blend_collisions(job, runs, sampled, deposits_laid)\n", "", ("cell/verdict/test_coordinated.py",)),
    Mutant("cell/verification/motion_check.py", "crossed = side[1:] != side[:-1]", "crossed = side[1:] != side[1:]", ("cell/verification/test_motion_check.py",)),
    Mutant("cell/verification/motion_check.py", "margin[:, j] < least[j] - SLACK", "margin[:, j] < 0.5 * least[j]", (LIMITS,)),
    Mutant("cell/verification/motion_check.py", "return limit * (1 + 1e-9) + 1e-6", "return 1.5 * limit * (1 + 1e-9) + 1e-6", (LIMITS,)),
    Mutant("cell/verification/drive_use.py", "mean * (1 - time / both) - blur", "mean * (1 - time / both) - 5 * blur", (ACCELERATIONS,)),
    Mutant("cell/verification/drive_use.py", "plain[-1] = np.inf", "plain[:] = np.inf", (HITS,)),
    Mutant("cell/verification/bead_order.py", "if behind.max() > _tolerance(job):", "if behind.max() > 3 * _tolerance(job):", (LIMITS,)),
    Mutant("cell/verification/bead_order.py", "if bead != last_bead + 1:", "if bead < last_bead:", (HITS,)),
    Mutant("cell/verification/bead_order.py", "flatnonzero(more > SKIP)", "flatnonzero(more > 5 * SKIP)", (HITS,)),
    Mutant("cell/verification/bead_order.py", "near = np.maximum.accumulate(progress[rows]), _tolerance(job)", "near = np.maximum.accumulate(progress[rows]), 5 * _tolerance(job)", (LIMITS,)),
    Mutant("cell/verification/bead_order.py", "        found += _waits(job, motion, progress, rows)\n", "", (HITS,)),
    Mutant("cell/verification/bead_order.py", "waits += [(rows[len(start) - 1 :]", "[(rows[len(start) - 1 :]", (HITS,)),
    Mutant("cell/verification/bead_order.py", "np.flatnonzero(turn > JUMP)[:1]", "np.flatnonzero(turn > 10)[:1]", ("cell/verification/test_motion_check.py",)),
    Mutant("cell/verification/bead_order.py", "np.nan_to_num(share) > FASTEST_SHARE)", "np.nan_to_num(share) > 3 * FASTEST_SHARE)", (LIMITS,)),
    Mutant("cell/verification/collisions.py", "np.where(inside, at_row[row], np.maximum(at_row[row], at_row[after]))", "at_row[row]", ("cell/verification/test_motion_check.py",)),
    Mutant("cell/verification/collisions.py", "return [*found, *table_collisions(job, sampled, deposits_laid)]", "return found", (HITS,)),
    Mutant("cell/verification/collisions.py", "*_wire_collisions(job, motion, sampled, deposits_laid), *_wires_in_metal", "*_wires_in_metal", (HITS,)),
    Mutant("cell/verification/collisions.py", ", *_wires_in_metal(job, motion, sampled)]", "]", ("cell/job/test_wire_in_metal.py",)),
    Mutant("cell/verification/collisions.py", "step, nearest = unproven_steps(checker, radius, q, laid, clear, run)", "step, nearest = unproven_steps(checker, radius, q[:1], laid[:1], clear.rows(np.arange(1)), run[:1])", ("cell/verification/test_wire_between_samples.py",)),
    Mutant("cell/table_poses/table_turn.py", "self.table_radius, table, deposits_laid, 0.0)", "self.table_radius, table, deposits_laid, -1.0)", ("cell/table_poses/test_table_turn.py",)),
    Mutant("cell/table_poses/table_turn.py", "self.wire, self.radius, axes, deposits_laid, 0.0)", "self.wire, self.radius, axes, deposits_laid, -1.0)", ("cell/table_poses/test_table_turn.py",)),
    Mutant("cell/table_poses/table_turn.py", "return self._failure(nearest, 0, least) if len(step) else found", "return found", ("cell/table_poses/test_table_turn.py",)),
    Mutant("cell/table_poses/table_turn.py", "axes, deposits_laid, self.clearance, self.kept)", "axes, deposits_laid, 0.0, 0.0)", ("cell/table_poses/test_table_turn.py",)),
    Mutant("cell/coordination/table_schedule.py", "for t in BETWEEN[1:-1]:", "for t in ():", ("cell/coordination/test_table_schedule.py",)),
    Mutant("ik/reachability_proof.py", "        undecided[target] = True\n", "", (PROOFS, DEVIATION)),
    Mutant("ik/reachability_proof.py", "open_ = self._endless(raw)", "open_ = np.zeros(len(Ts), dtype=bool)", (PROOFS, DEVIATION)),
    Mutant("ik/reachability_proof.py", "inside: Bools = room >= -SLACK", "inside: Bools = room >= 0.02", (PROOFS, DEVIATION)),
    Mutant("ik/reachability_proof.py", "if self.form.off is not None:", "if False:", (PROOFS, DEVIATION)),
    Mutant("ik/roll_bounds.py", "size * float(np.sin(min(half, np.pi / 2))) + PAD_LENGTH + self._off[0]", "size * float(np.sin(min(half, np.pi / 2))) + PAD_LENGTH", (PROOFS, DEVIATION)),
    Mutant("ik/roll_bounds.py", "size * float(np.sin(min(half, np.pi / 2))) + PAD", "0.8 * size * float(np.sin(min(half, np.pi / 2))) + PAD", (PROOFS, DEVIATION)),
    Mutant("ik/roll_bounds.py", "disc = self._spread((d, d_low), (rho, rho_low, rho_high), ball)", "disc = ball", (PROOFS, DEVIATION)),
    Mutant("ik/roll_bounds.py", "half_1 + half_phi),", "half_1),", (PROOFS, DEVIATION)),
    Mutant("cell/programs/round_trip.py", "self.position / (OFF + thinning.chord)", "self.position / (20 * OFF + thinning.chord)", ("cell/programs/test_export.py",)),
    Mutant("cell/programs/round_trip.py", '        ("blend", SAME_PLACE),\n', "", ("cell/programs/test_export.py",)),
    Mutant("cell/programs/round_trip.py", "if pair[0][:2] != pair[1][:2] or", "if", ("cell/programs/test_export.py",)),
    Mutant("cell/verdict/by_table_mode.py", 'if mode != "fixed":', "if False:", (BY_MODE,)),
    Mutant("cell/verdict/by_table_mode.py", "return _checked(job, progress) if asked is None", "return check_fixed(job, job.case.table.E1_deg, job.case.table.E2_deg, progress) if asked is None", (BY_MODE,)),
    Mutant("cell/verdict/by_table_mode.py", 'if not abs(angle) < float("inf"):', "if False:", (BY_MODE,)),
    Mutant("cell/motion/given_motion.py", "if found != shape:", "if False:", (GIVEN,)),
    Mutant("cell/motion/given_motion.py", 'return read_columns("motion", motion.to_frame(), job)', "return ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ())", (GIVEN,)),
    Mutant("cell/motion/file_order.py", "return again, renumbered(motion, again)", "return again, motion", (GIVEN,)),
    Mutant("cell/motion/file_order.py", "    motion = renumbered(motion, job)\n", "", (GIVEN,)),
    Mutant("cell/programs/exported/exported.py", "if self.fault is not None:", "if False:", (EXPORTED,)),
    Mutant("cell/programs/exported/exported.py", "[*case_files(self.job.case), *reads]", "reads", (EXPORTED,)),
    Mutant("cell/programs/exported/written_files.py", "if made and not done and folder is not None:", "if False:", (EXPORTED,)),
    Mutant("cell/programs/program_check.py", "    yield from _tools(run, job)\n", "", (PROGRAMS,)),
    Mutant("cell/programs/krl/data.py", "if name not in STANDARD:", "if False:", (INNER,)),
    Mutant("cell/programs/krl/execution.py", "if any(True for of in _expressions_of(one) for _ in calls_of(of)):", "if False:", (INNER,)),
    Mutant("cell/programs/krl/line_forms.py", "    if names:\n        yield Statement(\"inner\"", "    if not names:\n        yield Statement(\"inner\"", (INNER,)),
    Mutant("cell/programs/krl/execution.py", "self.function(inner.name, inner.arguments)", "pass", (INNER,)),
    Mutant("cell/programs/program_check.py", "    yield from _bases(run)\n", "", (PROGRAMS,)),
    Mutant("cell/programs/program_check.py", "    yield from _roots(run.program, job)\n", "", (PROGRAMS,)),
    Mutant("cell/programs/program_check.py", "    yield from _externals(run.program, job)\n", "", (PROGRAMS,)),
    Mutant("cell/programs/program_check.py", "    yield from _stretches(Failure(Kind.PATH_SPEED, limit=MOST_TCP_SPEED, place=IN_ROWS), run.program.moves.speed)\n", "", (PROGRAMS,)),
    Mutant("cell/programs/program_check.py", "    yield from _stretches(Failure(Kind.BLEND, limit=limit, place=IN_ROWS), wide)\n", "", (PROGRAMS,)),
    Mutant("cell/programs/program_check.py", "    yield from _stretches(Failure(Kind.ARC_CORNER, limit=0.0, place=IN_ROWS), _at_the_arc(run))\n", "", (PROGRAMS,)),
    Mutant("cell/programs/program_check.py", "    yield from _stretches(Failure(Kind.PTP_WITH_ARC, place=IN_ROWS), axes)\n", "", (PROGRAMS,)),
    Mutant("cell/mjcf/couplings.py", "elif kind in (EQ.mjEQ_CONNECT, EQ.mjEQ_WELD):", "elif kind == EQ.mjEQ_WELD:", ("cell/mjcf/test_couplings.py",)),
    Mutant("cell/mjcf/couplings.py", "            looked_at.check_tendons(number)\n", "            pass\n", ("cell/mjcf/test_couplings.py",)),
    Mutant("cell/planning/infeasible_part.py", "lost in bare.items() if not free.get(i)}", "lost in bare.items()}", ("cell/planning/test_ways_found.py",)),
    Mutant("cell/planning/collision_free_rolls.py", "outside | (turn < rolls[b] - rolls[a])", "outside | (turn < 0.2 * (rolls[b] - rolls[a]))", ("cell/planning/test_ways_found.py", "cell/planning/test_infeasible_part.py", "cell/planning/test_collision_free_rolls.py")),
    Mutant("cell/planning/collision_free_rolls.py", "known.held[:-1] + known.held[1:] < np.diff(known.roll)", "known.held[:-1] + known.held[1:] < 0.2 * np.diff(known.roll)", ("cell/planning/test_ways_found.py", "cell/planning/test_infeasible_part.py", "cell/planning/test_collision_free_rolls.py")),
    Mutant("cell/planning/collision_free_rolls.py", "< MOST_DETOUR * context.screen", "< 0.1 * MOST_DETOUR * context.screen", ("cell/planning/test_ways_found.py", "cell/planning/test_infeasible_part.py", "cell/planning/test_collision_free_rolls.py")),
    Mutant("cell/planning/infeasible_part.py", "rest = frozenset(range(first, stop)) - target_failures.keys()", "rest = frozenset[int]()", ("cell/planning/test_infeasible_part.py",)),
    Mutant("cell/planning/part_plan.py", "if not postponed or any(run.lost for run in found):", "if True:", ("cell/planning/test_part_plan.py",)),
    Mutant("cell/planning/part_plan.py", "judge = InfeasiblePartJudge(context, first, share, full_searches=0)", "judge = InfeasiblePartJudge(context, first, share, full_searches=1)", ("cell/planning/test_part_plan.py",)),
    Mutant("cell/planning/part_plan.py", "full_searches=searches, lost=lost)", "full_searches=searches)", ("cell/planning/test_part_plan.py",)),
    Mutant("cell/planning/infeasible_part.py", "            if not target_failures and self.full_searches <= 0:\n", "            if False:\n", ("cell/planning/test_part_plan.py",)),
    Mutant("cell/planning/bead_cut.py", ">= MOST_DETOUR * way", ">= 0.0 * way", (CUTS,)),
    Mutant("cell/planning/bead_cut.py", "return sector % len(blocked) if circular and len(blocked) else sector", "return sector", (CUTS,)),
    Mutant("cell/planning/bead_cut.py", "return sector % len(blocked) if circular and len(blocked) else sector", "return sector % max(len(blocked), 1)", (CUTS,)),
    Mutant("cell/planning/part_plan.py", "                out[k] = found[k].with_bead(cut)\n", "", (CUTS,)),
    Mutant("cell/planning/infeasible_part.py", "        self.spent += spent\n        if not bead.whole:", "        if not bead.whole:\n            self.spent += spent", (CUTS,)),
    Mutant("cell/planning/blocking_layers.py", "return failed - again.target_failures.keys() - again.edge_failures.keys() - again.open", "return failed", ("cell/planning/test_blocking_layers.py",)),
    Mutant("cell/planning/beads_ahead.py", "if known is not None and _same(known.q_before, q_before):", "if known is not None:", ("cell/planning/test_beads_ahead.py",)),
    # what the README promises of rows, layers, programs, remedies and logs
    Mutant("cell/planning/context.py", "position: float = 16e-3", "position: float = 60e-3", (STEPS,)),
    Mutant("cell/planning/context.py", "angle: float = np.deg2rad(2.0)", "angle: float = np.deg2rad(9.0)", (STEPS,)),
    Mutant("slicing/volume/layer_areas.py", "MOST_OFF = 0.02", "MOST_OFF = 0.2", ("slicing/volume/test_layer_areas.py",)),
    Mutant("slicing/volume/borders.py", "LENGTH_SHARE, LENGTH_MM = 0.02, 0.5", "LENGTH_SHARE, LENGTH_MM = 0.2, 5.0", (BORDERS,)),
    Mutant("slicing/volume/borders.py", "    if not as_many:\n", "    if False:\n", (BORDERS,)),
    Mutant("slicing/volume/borders.py", "    if not long_enough:\n", "    if False:\n", (BORDERS,)),
    Mutant("slicing/warning.py", "{Code.LAYER_AREA, Code.LAYER_LENGTH, Code.LAYER_LOOPS}", "{Code.LAYER_AREA, Code.LAYER_LENGTH}", (BORDERS,)),
    Mutant("slicing/warning.py", "{Code.LAYER_AREA, Code.LAYER_LENGTH, Code.LAYER_LOOPS}", "{Code.LAYER_LENGTH, Code.LAYER_LOOPS}", (BORDERS,)),
    Mutant("cell/job/job.py", "if line.code in WRONG_LAYER]", "if False]", (BORDERS,)),
    Mutant("cell/programs/export.py", "    if other is not None:\n", "    if False:\n", ("cell/programs/test_export.py",)),
    Mutant("cell/programs/export.py", "    if gap.share(written.thinning) > 1:\n", "    if False:\n", ("cell/programs/test_export.py",)),
    Mutant("cell/programs/export.py", "    if result.findings:\n", "    if False:\n", ("cell/programs/test_export.py",)),
    Mutant("cell/remedy_search/search.py", "if row.reason is not None}", "if row.failure is not None}", ("cell/remedy_search/test_search.py",)),
    Mutant("cell/remedy_search/search.py", "found = check_fixed(*self.start.changed(change, size))", "found = check_fixed(*self.start.changed(change, 0.0))", ("cell/remedy_search/test_search.py",)),
    Mutant("cell/processes/own_process.py", " and len(sys._current_frames()) == 1", "", (CREW,)),
    Mutant("cell/processes/own_process.py", '.split()[0] == "S"', '.split()[0] != "Z"', (CREW,)),
    Mutant("cell/processes/own_process.py", "            signal.signal(number, signal.SIG_DFL)\n", "            pass\n", (CREW,)),
    Mutant("cell/processes/worker.py", "Context().run(work, pipe, shared)", "work(pipe, shared)", (CREW,)),
    Mutant("cell/processes/work_round.py", "for k in self._left if k < error[0])", "for k in self._left if k < 0)", (CREW,)),
    Mutant("cell/processes/work_round.py", "Context().run(task.function, self.work.shared, ", "task.function(self.work.shared, ", (CREW,)),
    Mutant("cell/processes/work_round.py", "                self._ticks += 1\n", "                self.tick()\n", (CREW,)),
    Mutant("cell/processes/work_round.py", "if isinstance(index, int) and (self._error is None or ", "if (self._error is None or ", (CREW,)),
    Mutant("cell/processes/work_round.py", "if here and work.aside.both_ends else", "if False else", (CREW,)),
    Mutant("cell/processes/work_round.py", "if self._over or held:", "if self._over:", (CREW,)),
    Mutant("cell/processes/critical_path.py", "self.waited += max(max(", "self.waited += min(max(", ("cell/processes/test_critical_path.py",)),
    Mutant("cell/part_chunks/runs_ahead.py", "        and _are_same(one.travels, other.travels)\n", "", (AHEAD,)),
    Mutant("cell/part_chunks/runs_ahead.py", "        and _are_same(one.stretches, other.stretches)\n", "", (AHEAD,)),
    Mutant("cell/part_chunks/runs_ahead.py", "        same_home\n        and one.before", "        one.before", (AHEAD,)),
    Mutant("cell/part_chunks/runs_ahead.py", "self._chunks[k].before is not before or ", "", (AHEAD,)),
    Mutant("cell/part_chunks/runs_ahead.py", " or self._chunks[k].plan.beads[0] is not bead:", ":", (AHEAD,)),
    Mutant("cell/part_chunks/runs_ahead.py", "if turns_between(last, mine.plan).any():", "if False:", (AHEAD,)),
    Mutant("cell/part_chunks/runs_ahead.py", "not one.lost and one.postponed is None and one.plan.whole", "one.plan.whole", (AHEAD,)),
    Mutant("cell/processes/worker_pool.py", "if worker.shared != self._number and", "if worker.shared == 0 and", (CREW,)),
    Mutant("cell/processes/worker_pool.py", "            if one.unfinished:\n", "            if False:\n", (CREW,)),
    Mutant("cell/pose_sweep/log.py", "return row if row_line(row) == line else None", "return row", ("cell/pose_sweep/test_log.py",)),
)  # fmt: skip
