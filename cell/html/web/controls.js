// Turning, moving and zooming the view with mouse, fingers and keys.

import { add, clamp, cross, scale } from "./math.js";

const STEEPEST = 1.55;
const TURN = 0.008; // rad a pixel
const CLICK = 5; // pixels that a click may move

export function turn(viewer, dx, dy) {
  const c = viewer.camera;
  c.azimuth -= TURN * dx;
  c.elevation = clamp(c.elevation - TURN * dy, -STEEPEST, STEEPEST);
  viewer.redraw();
}

export function move(viewer, dx, dy) {
  const { forward, right } = viewer.directions();
  const up = cross(right, forward);
  const perPixel = (0.61 * viewer.camera.distance) / Math.max(viewer.canvas.clientHeight, 1);
  viewer.camera.lookat = add(viewer.camera.lookat, add(scale(right, -dx * perPixel), scale(up, dy * perPixel)));
  viewer.redraw();
}

export function zoom(viewer, factor) {
  viewer.camera.distance = clamp(viewer.camera.distance * factor, 0.005, 30);
  viewer.redraw();
}

/** Listen on the viewer's canvas; a click on a target calls onPick(target). */
export function attach(viewer, onPick) {
  const fingers = new Map();
  let travelled = 0;
  const { canvas } = viewer;

  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, [e.offsetX, e.offsetY]);
    travelled = fingers.size > 1 ? Infinity : 0;
  });
  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const now = [e.offsetX, e.offsetY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    travelled += Math.hypot(dx, dy);
    if (fingers.size > 1) pinch(viewer, fingers, e.pointerId, now);
    else if (e.shiftKey || e.buttons & 6) move(viewer, dx, dy);
    else turn(viewer, dx, dy);
    fingers.set(e.pointerId, now);
  });
  const lift = (e) => {
    if (!fingers.delete(e.pointerId) || e.type !== "pointerup" || travelled > CLICK || e.button !== 0) return;
    const i = viewer.pick(e.offsetX, e.offsetY);
    if (i >= 0) onPick(i);
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("contextmenu", (e) => e.preventDefault());
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    const lines = e.deltaMode === 1 ? 30 : 1;
    zoom(viewer, Math.exp(clamp(e.deltaY * lines, -200, 200) * 0.0015));
  }, { passive: false });
  canvas.addEventListener("dblclick", () => viewer.reset(viewer.view));
  canvas.addEventListener("keydown", (e) => key(viewer, e));
}

/** Two fingers: what is between them moves and grows with them. */
function pinch(viewer, fingers, id, now) {
  const other = [...fingers].find(([k]) => k !== id)[1];
  const before = fingers.get(id);
  const apart = (p) => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
  zoom(viewer, apart(before) / apart(now));
  move(viewer, (now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
}

function key(viewer, e) {
  const arrows = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] };
  if (e.ctrlKey || e.metaKey || e.altKey) return;
  if (e.key in arrows) (e.shiftKey ? move : turn)(viewer, ...arrows[e.key]);
  else if (e.key === "+" || e.key === "=") zoom(viewer, 0.87);
  else if (e.key === "-") zoom(viewer, 1.15);
  else if (e.key === "0" || e.key === "Home") viewer.reset(viewer.view);
  else return;
  e.preventDefault();
}
