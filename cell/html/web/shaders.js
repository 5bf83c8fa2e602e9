// Programs of the 3D view, GLSL ES 3.00.

export const LIT = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tint;
uniform mat4 see, place;
uniform vec4 colour;
uniform float own;
out vec3 world, outward;
out vec4 paint;
void main() {
  vec4 p = place * vec4(position, 1.0);
  world = p.xyz;
  outward = mat3(place) * normal;
  paint = mix(colour, tint, own);
  gl_Position = see * p;
}`;

// light from above and behind the eye's shoulder, sky and floor, a little gloss
export const LIT_FRAGMENT = `#version 300 es
precision highp float;
in vec3 world, outward;
in vec4 paint;
uniform vec3 eye, light;
out vec4 pixel;
void main() {
  vec3 toEye = normalize(eye - world);
  vec3 n = normalize(outward);
  if (dot(n, toEye) < 0.0) n = -n;
  float sky = 0.5 + 0.5 * n.z;
  float head = max(dot(n, toEye), 0.0);
  float sun = max(dot(n, light), 0.0);
  float gloss = pow(max(dot(n, normalize(light + toEye)), 0.0), 40.0);
  vec3 lifted = paint.rgb + 0.045; // black parts keep their shape on a dark page
  vec3 c = lifted * (0.26 + 0.22 * sky + 0.3 * head + 0.42 * sun) + 0.12 * gloss;
  pixel = vec4(min(c, 1.0), paint.a);
}`;

export const FLAT = `#version 300 es
layout(location = 0) in vec3 position;
layout(location = 2) in vec4 tint;
uniform mat4 see, place;
uniform vec4 colour;
uniform float own;
out vec4 paint;
void main() {
  paint = mix(colour, vec4(tint.rgb, 1.0), own);
  gl_Position = see * place * vec4(position, 1.0);
}`;

export const FLAT_FRAGMENT = `#version 300 es
precision mediump float;
in vec4 paint;
out vec4 pixel;
void main() { pixel = paint; }`;

// a target's mark is as large as its bead is thick, but never too small to see; it is pulled out of its own bead
export const POINT = `#version 300 es
layout(location = 0) in vec4 target;
layout(location = 2) in vec4 tint;
uniform mat4 see, place;
uniform vec3 eye;
uniform float size, ratio;
out vec4 paint;
void main() {
  vec3 middle = (place * vec4(target.xyz, 1.0)).xyz;
  vec4 p = see * vec4(middle + 2.2 * target.w * normalize(eye - middle), 1.0);
  float bad = tint.a;
  paint = vec4(tint.rgb, 1.0);
  gl_PointSize = max(mix(0.55, 1.0, bad) * target.w * size / p.w, mix(3.0, 6.0, bad) * ratio);
  gl_Position = p;
}`;

export const POINT_FRAGMENT = `#version 300 es
precision mediump float;
in vec4 paint;
out vec4 pixel;
void main() {
  vec2 at = 2.0 * gl_PointCoord - 1.0;
  float r = dot(at, at);
  if (r > 1.0) discard;
  pixel = vec4(r > 0.6 ? paint.rgb * 0.55 : paint.rgb, 1.0);
}`;

/** A compiled program with the places of its uniforms. */
export function program(gl, vertex, fragment) {
  const out = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(out, shader);
  }
  gl.linkProgram(out);
  if (!gl.getProgramParameter(out, gl.LINK_STATUS) && !gl.isContextLost()) {
    const why = gl.getAttachedShaders(out).map((s) => gl.getShaderInfoLog(s));
    throw new Error(`shader: ${[gl.getProgramInfoLog(out), ...why].join(" ")}`);
  }
  const at = {};
  const count = gl.getProgramParameter(out, gl.ACTIVE_UNIFORMS);
  for (let i = 0; i < count; i++) {
    const { name } = gl.getActiveUniform(out, i);
    at[name] = gl.getUniformLocation(out, name);
  }
  return { program: out, at };
}
