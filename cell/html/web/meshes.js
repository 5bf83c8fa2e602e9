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

function ring(vertices, at, centre, along, up, radius) {
  const side = unit(cross(along, up));
  const rise = cross(side, along);
  for (let k = 0; k < SIDES; k++) {
    const angle = (2 * Math.PI * k) / SIDES;
    const out = add(scale(side, Math.cos(angle)), scale(rise, Math.sin(angle)));
    vertices.set([...add(centre, scale(out, radius)), ...out], 6 * (at + k));
  }
}

function tubeFaces(faces, from, to) {
  for (let k = 0; k < SIDES; k++) {
    const l = (k + 1) % SIDES;
    faces.push(from + k, from + l, to + l, from + k, to + l, to + k);
  }
}

function capFaces(faces, at) {
  for (let k = 2; k < SIDES; k++) faces.push(at, at + k - 1, at + k);
}

/**
 * All beads: one ring of vertices a target, and faces in the order of deposition.
 * `upTo[i]` is how many face indices are laid once target i is reached.
 */
export function beadTubes(targets) {
  const vertices = new Float32Array(6 * SIDES * targets.count);
  const faces = [];
  const upTo = new Uint32Array(targets.count);
  for (let i = 0; i < targets.count; i++) {
    ring(vertices, i * SIDES, targets.middle(i), targets.along(i), targets.out(i), targets.thickness[i] / 2);
    if (targets.joined(i - 1)) tubeFaces(faces, (i - 1) * SIDES, i * SIDES);
    if (!targets.joined(i - 1) || !targets.joined(i)) capFaces(faces, i * SIDES);
    upTo[i] = faces.length;
  }
  return { vertices, faces: new Uint32Array(faces), upTo, sides: SIDES };
}

/** A solid of revolution along a straight line: stations are [place 0 .. 1, radius]. */
export function rod(from, to, stations) {
  const along = unit(sub(to, from));
  const vertices = new Float32Array(6 * SIDES * stations.length);
  const faces = [];
  stations.forEach(([place, radius], i) => {
    const centre = add(from, scale(sub(to, from), place));
    ring(vertices, i * SIDES, centre, along, across(along), radius);
    if (i) tubeFaces(faces, (i - 1) * SIDES, i * SIDES);
  });
  capFaces(faces, 0);
  capFaces(faces, (stations.length - 1) * SIDES);
  return { vertices, faces: new Uint32Array(faces) };
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
