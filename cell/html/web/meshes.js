// Shapes that are made here: beads as tubes in the order of deposition, single rods, arrows, the floor's grid.

import { across, add, cross, scale, sub, unit } from "./math.js";

const SIDES = 8;

/** Targets as vectors, part frame, metres. */
export class Targets {
  constructor(t) {
    this.position = t.position;
    this.normal = t.normal;
    this.thickness = t.thickness;
    this.bead = t.bead;
    this.layer = t.layer;
    this.sub_volume = t.sub_volume;
    this.verdict = t.verdict;
    this.hanging = t.hanging; // of feasible targets; absent where none overhangs
    this.gravity = t.gravity; // absent where the part is feasible, and so
    this.base_mm = t.base_mm; // are these
    this.count = t.thickness.length;
  }

  at(i) {
    return [this.position[3 * i], this.position[3 * i + 1], this.position[3 * i + 2]];
  }

  out(i) {
    const n = this.normal;
    return unit([n[3 * i], n[3 * i + 1], n[3 * i + 2]]);
  }

  /** Middle of the bead: it lies on its slicing surface. */
  middle(i) {
    return add(this.at(i), scale(this.out(i), this.thickness[i] / 2));
  }

  /** Whether a bead leads from i to i + 1. */
  joined(i) {
    return i >= 0 && i + 1 < this.count && this.bead[i] === this.bead[i + 1];
  }

  /** Direction of travel at a target. */
  along(i) {
    const a = this.joined(i - 1) ? unit(sub(this.at(i), this.at(i - 1))) : null;
    const b = this.joined(i) ? unit(sub(this.at(i + 1), this.at(i))) : null;
    if (a && b) return unit(add(a, b));
    return a || b || across(this.out(i));
  }
}

const TUBE = 6 * SIDES; // indices between two rings
const CAP = 3 * (SIDES - 2);
const ROUND = Array.from({ length: SIDES }, (_, k) => (2 * Math.PI * k) / SIDES).map((a) => [Math.cos(a), Math.sin(a)]);

function ring(vertices, at, centre, along, up, radius) {
  const side = unit(cross(along, up));
  const rise = cross(side, along);
  // by its numbers: parts have tens of thousands of rings
  for (let k = 0; k < SIDES; k++) {
    const [c, s] = ROUND[k];
    for (let axis = 0; axis < 3; axis++) {
      const out = side[axis] * c + rise[axis] * s;
      vertices[6 * (at + k) + axis] = centre[axis] + out * radius;
      vertices[6 * (at + k) + 3 + axis] = out;
    }
  }
}

/** Faces between two rings, from a place in `faces` on; the place after them. */
function tubeFaces(faces, at, from, to) {
  for (let k = 0; k < SIDES; k++) {
    const l = (k + 1) % SIDES;
    faces[at++] = from + k;
    faces[at++] = from + l;
    faces[at++] = to + l;
    faces[at++] = from + k;
    faces[at++] = to + l;
    faces[at++] = to + k;
  }
  return at;
}

function capFaces(faces, at, from) {
  for (let k = 2; k < SIDES; k++) {
    faces[at++] = from;
    faces[at++] = from + k - 1;
    faces[at++] = from + k;
  }
  return at;
}

/**
 * All beads: one ring of vertices a target, and faces in the order of deposition.
 * `upTo[i]` is how many face indices are laid once target i is reached.
 */
export function beadTubes(targets) {
  const vertices = new Float32Array(6 * SIDES * targets.count);
  const upTo = new Uint32Array(targets.count);
  const joined = Uint8Array.from({ length: targets.count + 1 }, (_, i) => targets.joined(i - 1)); // to the one before
  let size = 0;
  for (let i = 0; i < targets.count; i++) {
    ring(vertices, i * SIDES, targets.middle(i), targets.along(i), targets.out(i), targets.thickness[i] / 2);
    size += (joined[i] ? TUBE : 0) + (joined[i] && joined[i + 1] ? 0 : CAP);
    upTo[i] = size;
  }
  const faces = new Uint32Array(size);
  for (let i = 0; i < targets.count; i++) {
    let at = i ? upTo[i - 1] : 0;
    if (joined[i]) at = tubeFaces(faces, at, (i - 1) * SIDES, i * SIDES);
    if (!joined[i] || !joined[i + 1]) capFaces(faces, at, i * SIDES);
  }
  return { vertices, faces, upTo, sides: SIDES };
}

/** A solid of revolution along a straight line: stations are [place 0 .. 1, radius]. */
export function rod(from, to, stations) {
  const along = unit(sub(to, from));
  const vertices = new Float32Array(6 * SIDES * stations.length);
  const faces = new Uint32Array((stations.length - 1) * TUBE + 2 * CAP);
  let laid = 0;
  stations.forEach(([place, radius], i) => {
    const centre = add(from, scale(sub(to, from), place));
    ring(vertices, i * SIDES, centre, along, across(along), radius);
    if (i) laid = tubeFaces(faces, laid, (i - 1) * SIDES, i * SIDES);
  });
  laid = capFaces(faces, laid, 0);
  capFaces(faces, laid, (stations.length - 1) * SIDES);
  return { vertices, faces };
}

/** An arrow. */
export function arrow(from, to, radius) {
  return rod(from, to, [[0, radius], [0.72, radius], [0.72, 2.6 * radius], [1, 0.01 * radius]]);
}

/** Lines of the unlaid beads: index pairs, in the order of deposition, and how many belong to target i and before. */
export function beadLines(targets) {
  const pairs = [];
  const upTo = new Uint32Array(targets.count);
  for (let i = 0; i < targets.count; i++) {
    if (targets.joined(i - 1)) pairs.push(i - 1, i);
    upTo[i] = pairs.length;
  }
  return { pairs: new Uint32Array(pairs), upTo };
}

/** A square grid on the floor, positions of line ends. */
export function gridLines(height, half, step) {
  const out = [];
  for (let v = -half; v <= half + 1e-9; v += step) {
    out.push(v, -half, height, v, half, height, -half, v, height, half, v, height);
  }
  return new Float32Array(out);
}
