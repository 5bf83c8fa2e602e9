// The 3D view: WebGL 2, drawn only when something has changed. World frame, z up, metres.

import { add, apply, cross, dot, lookAlong, multiply, perspective, project, scale, sub, norm, unit, IDENTITY } from "./math.js";
import { expanded } from "./scene.js";
import { lineSet, marks, surface } from "./buffers.js";
import { arrow, beadLines, beadTubes, gridLines, rod } from "./meshes.js";
import { FLAT, FLAT_FRAGMENT, LIT, LIT_FRAGMENT, POINT, POINT_FRAGMENT, program } from "./shaders.js";

const FOVY = (34 * Math.PI) / 180; // as pictures have it
const RED = [0.88, 0.08, 0.06], OPEN = [0.54, 0.58, 0.61];
const LIGHT = unit([0.35, 0.5, 1.0]); // towards the light
// what is drawn while things move: pixels a CSS pixel (none: as at rest) and shadows; slow machines go down the list
/** @type { { ratio?: number, shadow: boolean }[] } */
const MOVING = [{ shadow: true }, { ratio: 1, shadow: true }, { ratio: 0.7, shadow: false }, { ratio: 0.5, shadow: false }];
const SLOW = 40; // ms a frame
const REST = 160; // ms without a change
const GHOST = 0.28;
const SHADOWED = 0.16;

export class Viewer {
  /** A canvas, the page's document, the cell as it stands, and the targets. */
  constructor(canvas, doc, cell, targets) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: true, stencil: true });
    if (!gl) throw new Error("no WebGL 2");
    this.canvas = canvas;
    this.gl = gl;
    this.doc = doc;
    this.cell = cell;
    this.targets = targets;
    this.view = "part";
    this.show = { arm: true, targets: true, volume: true };
    this.laid = targets.count - 1; // last target reached
    this.live = false; // whether the bead goes on to the wire
    this.chosen = -1;
    this.red = new Set();
    this.effort = 0; // how much is left out while things move, see MOVING
    this.pace = 0; // ms a frame, smoothed
    this._build();
    this.reset("part");
  }

  _build() {
    const gl = this.gl;
    this.lit = program(gl, LIT, LIT_FRAGMENT);
    this.flat = program(gl, FLAT, FLAT_FRAGMENT);
    this.point = program(gl, POINT, POINT_FRAGMENT);
    this.surfaces = this.doc.scene.geoms.map((g) => surface(gl, expanded(g), g.faces));
    const tubes = beadTubes(this.targets);
    this.beads = { ...surface(gl, tubes.vertices, tubes.faces, true), upTo: tubes.upTo, sides: tubes.sides };
    const lines = beadLines(this.targets);
    this.marks = marks(gl, this.targets, lines.pairs);
    this.linesUpTo = lines.upTo;
    this.scratch = surface(gl, new Float32Array(6), new Uint32Array(3));
    const { floor } = this.doc.scene;
    this.grid = floor === null ? null : lineSet(gl, gridLines(floor, 4, 0.25));
    this.recolour(() => [0.5, 0.5, 0.5]);
  }

  /** Colour beads by colourOf(target) -> [r, g, b] in 0 .. 1; marks show the verdict where markOf is given. */
  recolour(colourOf, markOf = colourOf) {
    const { gl, targets, beads } = this;
    const bead = new Uint8Array(4 * beads.sides * targets.count);
    const mark = new Uint8Array(4 * targets.count);
    this.colourOf = colourOf;
    for (let i = 0; i < targets.count; i++) {
      const bytes = [...colourOf(i).map((v) => Math.round(255 * v)), 255];
      for (let k = 0; k < beads.sides; k++) bead.set(bytes, 4 * (beads.sides * i + k));
      // a mark's last byte says whether it is an infeasible target's, which are drawn larger
      mark.set([...markOf(i).map((v) => Math.round(255 * v)), targets.verdict[i] ? 255 : 0], 4 * i);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, beads.colours);
    gl.bufferData(gl.ARRAY_BUFFER, bead, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.marks.colours);
    gl.bufferData(gl.ARRAY_BUFFER, mark, gl.STATIC_DRAW);
    this.redraw();
  }

  /** A view's own camera. */
  reset(view) {
    this.view = view;
    const found = this.doc.scene.cameras[view === "cell" ? "cell" : "torch"];
    this.camera = { ...found, lookat: [...found.lookat] };
    const narrow = Math.max(1, 1 / this.aspect()); // they are chosen for a square view
    this.camera.distance *= narrow;
    if (view === "part") {
      const { centre, radius } = this._extent();
      this.camera.lookat = centre;
      this.camera.elevation = Math.min(this.camera.elevation, -0.3);
      this.camera.distance = (1.15 * radius * Math.max(1, 1 / this.aspect())) / Math.sin(FOVY / 2);
    }
    this.redraw();
  }

  /** A ball about all targets, world. */
  _extent() {
    const low = [Infinity, Infinity, Infinity];
    const high = [-Infinity, -Infinity, -Infinity];
    const m = this.cell.partMatrix();
    for (let i = 0; i < this.targets.count; i++) {
      apply(m, this.targets.at(i)).forEach((v, k) => {
        low[k] = Math.min(low[k], v);
        high[k] = Math.max(high[k], v);
      });
    }
    return { centre: scale(add(low, high), 0.5), radius: Math.max(norm(sub(high, low)) / 2, 0.005) };
  }

  /** Bring a target into the middle, as near as is useful. */
  centreOn(i) {
    this.camera.lookat = apply(this.cell.partMatrix(), this.targets.middle(i));
    if (this.view === "part") this.camera.distance = Math.min(this.camera.distance, 60 * this.targets.thickness[i]);
    this.redraw();
  }

  aspect() {
    return this.shape ?? Math.max(this.canvas.clientWidth, 1) / Math.max(this.canvas.clientHeight, 1);
  }

  directions() {
    const { azimuth: a, elevation: e } = this.camera;
    const forward = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    return { forward, right: [Math.sin(a), -Math.cos(a), 0] };
  }

  eye() {
    return sub(this.camera.lookat, scale(this.directions().forward, this.camera.distance));
  }

  matrix() {
    const { forward, right } = this.directions();
    const d = this.camera.distance;
    const see = lookAlong(this.eye(), forward, right);
    return multiply(perspective(FOVY, this.aspect(), 0.03 * d, 12 + 6 * d), see);
  }

  /** The target nearest to a place in the picture (CSS pixels), -1 if none is within reach of a finger. */
  pick(x, y, reach = 14) {
    const m = multiply(this.matrix(), this.cell.partMatrix());
    const { clientWidth: w, clientHeight: h } = this.canvas;
    let best = -1;
    let least = reach;
    for (let i = 0; i < this.targets.count; i++) {
      const p = project(m, this.targets.middle(i));
      if (!p) continue;
      const away = Math.hypot(((p[0] + 1) / 2) * w - x, ((1 - p[1]) / 2) * h - y);
      if (away < least) [best, least] = [i, away];
    }
    return best;
  }

  redraw() {
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.draw(), REST);
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame((now) => {
      this.waiting = false;
      this._keepPace(now);
      this.draw(MOVING[this.effort]);
    });
  }

  /** Leave more out where frames that follow each other come too slowly. */
  _keepPace(now) {
    const took = now - (this.before ?? -Infinity);
    this.before = now;
    if (took > 1000) return;
    this.pace = this.pace ? 0.6 * this.pace + 0.4 * took : took;
    if (this.pace > SLOW && this.effort < MOVING.length - 1) {
      this.effort += 1;
      this.pace = 0;
    }
  }

  /** Two pixels a CSS pixel stand in for smoothed edges, which cost more. */
  _resize(ratio = Math.min(Math.max(window.devicePixelRatio || 1, 2), 2.5)) {
    const [w, h] = [this.canvas.clientWidth, this.canvas.clientHeight].map((v) => Math.max(1, Math.round(v * ratio)));
    if (this.canvas.width !== w || this.canvas.height !== h) Object.assign(this.canvas, { width: w, height: h });
  }

  /** The view in another size, as a data URL; the camera goes back as far as a narrower picture needs. */
  still(width, height) {
    const { canvas } = this;
    Object.assign(canvas, { width, height });
    this.shape = width / height;
    const distance = this.camera.distance;
    this.camera.distance *= Math.max(1, canvas.clientWidth / canvas.clientHeight / this.shape);
    this._paint(true);
    const url = canvas.toDataURL("image/png");
    this.shape = null;
    this.camera.distance = distance;
    this.redraw();
    return url;
  }

  /** Draw once. @param { { ratio?: number, shadow: boolean } } effort */
  draw({ ratio, shadow } = { shadow: true }) {
    this._resize(ratio);
    this._paint(shadow);
  }

  _paint(shadow) {
    const gl = this.gl;
    if (gl.isContextLost()) return;
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.see = this.matrix();
    this._drawFloor(shadow);
    this._drawSolids();
    this._drawBeads();
    this._drawMarks();
    this._drawChosen();
    if (this.show.volume) this._drawGhosts((g) => g.role === "volume", 0.2);
    if (this.view === "part" && this.show.arm) this._drawGhosts((g) => g.role === "tool", GHOST);
  }

  /** Whether a geom is drawn solid in this view. */
  _solid(geom, i) {
    if (this.red.has(i)) return true;
    if (geom.role === "part") return true;
    if (geom.role === "volume" || geom.role === "culprit" || this.view === "part") return false;
    return geom.role === "cell" || this.show.arm;
  }

  _useLit(colour, alpha, own) {
    const { gl, lit } = this;
    gl.useProgram(lit.program);
    gl.uniformMatrix4fv(lit.at.see, false, this.see);
    gl.uniform3fv(lit.at.eye, this.eye());
    gl.uniform3fv(lit.at.light, LIGHT);
    gl.uniform4f(lit.at.colour, ...colour, alpha);
    gl.uniform1f(lit.at.own, own ? 1 : 0);
  }

  _surfaceDrawn(surface, matrix, count = surface.count) {
    const { gl, lit } = this;
    gl.uniformMatrix4fv(lit.at.place, false, matrix);
    gl.bindVertexArray(surface.vao);
    gl.drawElements(gl.TRIANGLES, count, surface.type, 0);
  }

  _drawSolids() {
    this.doc.scene.geoms.forEach((geom, i) => {
      if (!this._solid(geom, i)) return;
      const place = this.cell.geomMatrix(i);
      if (!this._inSight(apply(place, geom.middle), norm(geom.half))) return;
      this._useLit(this.red.has(i) ? RED : geom.colour, 1, false);
      this._surfaceDrawn(this.surfaces[i], place);
    });
  }

  /** Whether some of a ball can be in the picture. */
  _inSight(centre, radius) {
    const { forward, right } = this.directions();
    const out = sub(centre, this.eye());
    const depth = dot(out, forward);
    const tall = Math.tan(FOVY / 2);
    const within = (axis, slope) => Math.abs(dot(out, axis)) <= Math.max(depth, 0) * slope + radius * Math.hypot(1, slope);
    return depth > -radius && within(right, tall * this.aspect()) && within(cross(right, forward), tall);
  }

  _drawBeads() {
    if (this.laid < 0 && !this.live) return;
    const place = this.cell.partMatrix();
    this._useLit([1, 1, 1], 1, true);
    if (this.laid >= 0) this._surfaceDrawn(this.beads, place, this.beads.upTo[this.laid]);
    if (!this.live) return;
    const { point, wire } = this.cell.tcpInPart();
    const radius = this.targets.thickness[this.laid] / 2;
    const end = sub(point, scale(wire, radius));
    const start = this.targets.middle(this.laid);
    if (norm(sub(end, start)) < 1e-6) return;
    this._useLit(this.colourOf(this.laid), 1, false);
    this._drawOnce(rod(start, end, [[0, radius], [1, radius]]), place);
  }

  /** A shape that is another one in the next frame. */
  _drawOnce({ vertices, faces }, place) {
    const gl = this.gl;
    gl.bindVertexArray(this.scratch.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.scratch.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.DYNAMIC_DRAW);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.DYNAMIC_DRAW);
    this._surfaceDrawn(this.scratch, place, faces.length);
  }

  _drawMarks() {
    const { gl, point, flat, targets } = this;
    const place = this.cell.partMatrix();
    gl.bindVertexArray(this.marks.vao);
    gl.useProgram(flat.program);
    gl.uniformMatrix4fv(flat.at.see, false, this.see);
    gl.uniformMatrix4fv(flat.at.place, false, place);
    gl.uniform1f(flat.at.own, 1);
    const first = this.laid < 0 ? 0 : this.linesUpTo[this.laid];
    gl.drawElements(gl.LINES, this.marks.lines - first, gl.UNSIGNED_INT, 4 * first);
    if (!this.show.targets) return;
    gl.useProgram(point.program);
    gl.uniformMatrix4fv(point.at.see, false, this.see);
    gl.uniformMatrix4fv(point.at.place, false, place);
    gl.uniform3fv(point.at.eye, this.eye());
    gl.uniform1f(point.at.size, this.canvas.height / Math.tan(FOVY / 2));
    gl.uniform1f(point.at.ratio, this.canvas.width / Math.max(this.canvas.clientWidth, 1));
    gl.drawArrays(gl.POINTS, 0, targets.count);
  }

  /** The chosen target's deposition direction. */
  _drawChosen() {
    const i = this.chosen;
    if (i < 0) return;
    const from = this.targets.middle(i);
    const length = 0.17 * this.camera.distance;
    const verdict = this.targets.verdict[i];
    const open = this.doc.verdicts[verdict] === "not_looked_at";
    const colour = open ? OPEN : verdict ? RED : [0.15, 0.4, 0.85];
    this._useLit(colour, 1, false);
    this._drawOnce(arrow(from, add(from, scale(this.targets.out(i), length)), length / 45), this.cell.partMatrix());
  }

  /** Translucent surfaces: their nearest side only. */
  _drawGhosts(wanted, alpha) {
    const gl = this.gl;
    const drawn = this.doc.scene.geoms.map((g, i) => i).filter((i) => wanted(this.doc.scene.geoms[i]) && !this.red.has(i));
    gl.colorMask(false, false, false, false);
    const once = () => drawn.forEach((i) => {
      this._useLit(this.doc.scene.geoms[i].colour, alpha, false);
      this._surfaceDrawn(this.surfaces[i], this.cell.geomMatrix(i));
    });
    once();
    gl.colorMask(true, true, true, true);
    gl.enable(gl.BLEND);
    once();
    gl.disable(gl.BLEND);
  }

  /** The floor's grid, and on it the shadow of what stands there. */
  _drawFloor(shadow) {
    if (!this.grid || this.view === "part") return;
    const { gl, flat, grid } = this;
    gl.useProgram(flat.program);
    gl.uniformMatrix4fv(flat.at.see, false, this.see);
    gl.uniform1f(flat.at.own, 0);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    gl.uniformMatrix4fv(flat.at.place, false, IDENTITY);
    gl.uniform4f(flat.at.colour, 0.5, 0.55, 0.6, 0.45);
    gl.bindVertexArray(grid.vao);
    gl.drawArrays(gl.LINES, 0, grid.count);
    if (shadow) this._drawShadow();
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  _drawShadow() {
    const { gl, flat } = this;
    const [x, y, z] = LIGHT;
    const h = this.doc.scene.floor;
    const down = [1, 0, 0, 0, 0, 1, 0, 0, -x / z, -y / z, 0, 0, (h * x) / z, (h * y) / z, h, 1];
    // each pixel once, however many surfaces cast a shadow on it
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.uniform4f(flat.at.colour, 0, 0, 0, SHADOWED);
    this.doc.scene.geoms.forEach((geom, i) => {
      if (geom.role === "culprit" || geom.role === "volume" || !this._solid(geom, i)) return;
      gl.uniformMatrix4fv(flat.at.place, false, multiply(down, this.cell.geomMatrix(i)));
      gl.bindVertexArray(this.surfaces[i].vao);
      gl.drawElements(gl.TRIANGLES, this.surfaces[i].count, this.surfaces[i].type, 0);
    });
    gl.disable(gl.STENCIL_TEST);
  }
}
