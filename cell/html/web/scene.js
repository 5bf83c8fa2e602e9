// The cell as bodies with joints: forward kinematics, and the surfaces in a form that a graphics card takes.

import { apply, applyDirection, fromPose, multiply, rigidInverse, turnAbout, IDENTITY } from "./math.js";

const GRID = 32767; // coordinates are quantised to it, see cell/html_shapes.py

export class Cell {
  constructor(scene) {
    this.scene = scene;
    this.world = scene.bodies.map(() => IDENTITY);
    this.local = scene.bodies.map((b) => fromPose(b.pos, b.quat));
    this.places = scene.geoms.map((g) => fromPose(g.pos, g.quat));
    this.part = { body: scene.part.body, local: fromPose(scene.part.pos, scene.part.quat) };
    this.tcp = { body: scene.tcp.body, local: fromPose(scene.tcp.pos, scene.tcp.quat) };
  }

  /** Bring the cell to angles: arm first, then E1 and E2, rad. */
  pose(angles) {
    // a body comes after its parent
    this.scene.bodies.forEach((body, i) => {
      if (i === 0) return;
      let m = multiply(this.world[body.parent], this.local[i]);
      for (const { angle, axis, pos, zero } of body.joints) {
        m = multiply(m, turnAbout(pos, axis, angles[angle] - zero));
      }
      this.world[i] = m;
    });
  }

  geomMatrix(i) {
    return multiply(this.world[this.scene.geoms[i].body], this.places[i]);
  }

  partMatrix() {
    return multiply(this.world[this.part.body], this.part.local);
  }

  tcpMatrix() {
    return multiply(this.world[this.tcp.body], this.tcp.local);
  }

  /** The wire's end and direction in the part's frame. */
  tcpInPart() {
    const toPart = rigidInverse(this.partMatrix());
    const tcp = this.tcpMatrix();
    return {
      point: apply(toPart, [tcp[12], tcp[13], tcp[14]]),
      wire: applyDirection(toPart, [tcp[8], tcp[9], tcp[10]]),
    };
  }
}

/** A geom's quantised surface as floats: position and normal of every vertex, six numbers each. */
export function expanded(geom) {
  const n = geom.vertices.length / 3;
  const out = new Float32Array(6 * n);
  for (let i = 0; i < n; i++) {
    for (let k = 0; k < 3; k++) {
      out[6 * i + k] = geom.middle[k] + (geom.vertices[3 * i + k] / GRID) * geom.half[k];
      out[6 * i + 3 + k] = geom.normals[3 * i + k] / 127;
    }
  }
  return out;
}
