// Shapes on the graphics card.

function filled(gl, kind, data) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(kind, buffer);
  gl.bufferData(kind, data, gl.STATIC_DRAW);
  return buffer;
}

function attribute(gl, at, size, stride, offset) {
  gl.enableVertexAttribArray(at);
  gl.vertexAttribPointer(at, size, gl.FLOAT, false, stride, offset);
}

function colours(gl, count) {
  const buffer = filled(gl, gl.ARRAY_BUFFER, new Uint8Array(4 * count));
  gl.enableVertexAttribArray(2);
  gl.vertexAttribPointer(2, 4, gl.UNSIGNED_BYTE, true, 4, 0);
  return buffer;
}

/** Triangles: place and normal of every vertex, six numbers each; `coloured` ones have a colour each as well. */
export function surface(gl, vertices, faces, coloured = false) {
  const vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  const buffer = filled(gl, gl.ARRAY_BUFFER, vertices);
  attribute(gl, 0, 3, 24, 0);
  attribute(gl, 1, 3, 24, 12);
  const tints = coloured ? colours(gl, vertices.length / 6) : null;
  filled(gl, gl.ELEMENT_ARRAY_BUFFER, faces);
  gl.bindVertexArray(null);
  const type = faces instanceof Uint16Array ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT;
  return { vao, buffer, colours: tints, type, count: faces.length };
}

/** Targets as points (place, and radius of the mark) and as ends of lines. */
export function marks(gl, targets, pairs) {
  const data = new Float32Array(4 * targets.count);
  for (let i = 0; i < targets.count; i++) data.set([...targets.middle(i), targets.thickness[i] / 2], 4 * i);
  const vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  filled(gl, gl.ARRAY_BUFFER, data);
  attribute(gl, 0, 4, 16, 0);
  const tints = colours(gl, targets.count);
  filled(gl, gl.ELEMENT_ARRAY_BUFFER, pairs);
  gl.bindVertexArray(null);
  return { vao, colours: tints, lines: pairs.length };
}

/** Lines by the places of their ends. */
export function lineSet(gl, ends) {
  const vao = gl.createVertexArray();
  gl.bindVertexArray(vao);
  filled(gl, gl.ARRAY_BUFFER, ends);
  attribute(gl, 0, 3, 12, 0);
  gl.bindVertexArray(null);
  return { vao, count: ends.length / 3 };
}
