// Vectors as arrays, 4 x 4 matrices in columns (as WebGL takes them), quaternions wxyz.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const norm = (a) => Math.hypot(a[0], a[1], a[2]);
export const clamp = (v, low, high) => Math.min(high, Math.max(low, v));

export function unit(a) {
  const n = norm(a);
  return n > 1e-12 ? scale(a, 1 / n) : [0, 0, 1];
}

/** Any unit vector across a. */
export function across(a) {
  return unit(cross(a, Math.abs(a[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
}

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

export function fromPose(pos, quat) {
  const [w, x, y, z] = quat;
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0,
    pos[0], pos[1], pos[2], 1,
  ];
}

/** Rotation by an angle about an axis through a point. */
export function turnAbout(point, axis, angle) {
  const s = Math.sin(angle / 2);
  const m = fromPose([0, 0, 0], [Math.cos(angle / 2), axis[0] * s, axis[1] * s, axis[2] * s]);
  const moved = sub(point, applyDirection(m, point));
  return [...m.slice(0, 12), ...moved, 1];
}

export function multiply(a, b) {
  const out = new Array(16);
  for (let c = 0; c < 16; c += 4) {
    for (let r = 0; r < 4; r++) {
      out[c + r] = a[r] * b[c] + a[4 + r] * b[c + 1] + a[8 + r] * b[c + 2] + a[12 + r] * b[c + 3];
    }
  }
  return out;
}

export function apply(m, p) {
  return add(applyDirection(m, p), [m[12], m[13], m[14]]);
}

export function applyDirection(m, v) {
  return [
    m[0] * v[0] + m[4] * v[1] + m[8] * v[2],
    m[1] * v[0] + m[5] * v[1] + m[9] * v[2],
    m[2] * v[0] + m[6] * v[1] + m[10] * v[2],
  ];
}

/** Inverse of a rigid pose. */
export function rigidInverse(m) {
  const r = [m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0];
  const p = scale(applyDirection(r, [m[12], m[13], m[14]]), -1);
  return [...r, ...p, 1];
}

export function perspective(fovy, aspect, near, far) {
  const f = 1 / Math.tan(fovy / 2);
  const d = 1 / (near - far);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) * d, -1, 0, 0, 2 * near * far * d, 0];
}

/** World to eye: looking along forward, with right to the right. */
export function lookAlong(eye, forward, right) {
  const up = cross(right, forward);
  const r = [right[0], up[0], -forward[0], 0, right[1], up[1], -forward[1], 0, right[2], up[2], -forward[2], 0];
  return [...r, ...scale(applyDirection(r, eye), -1), 1];
}

/** Where a point is in a picture, -1 .. 1 across and up; null behind the eye. */
export function project(m, p) {
  const w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
  if (w <= 0) return null;
  const q = apply(m, p);
  return [q[0] / w, q[1] / w];
}
