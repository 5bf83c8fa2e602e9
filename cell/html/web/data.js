// The page's numbers: base64 of gzip of a JSON with typed arrays behind it (written by cell/html/pack.py).

const ARRAYS = {
  f4: Float32Array,
  i1: Int8Array,
  i2: Int16Array,
  i4: Int32Array,
  u1: Uint8Array,
  u2: Uint16Array,
  u4: Uint32Array,
};

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/** Numbers written as differences: planes of bytes, lowest first, of column after column; flat, row after row. */
function fromSteps(bytes, { n, per, columns, planes, order, gaps = [] }) {
  const out = new Float64Array(n);
  const rows = n / columns;
  for (let c = 0; c < columns; c++) {
    let [value, slope] = [0, 0];
    for (let i = 0; i < rows; i++) {
      let coded = 0;
      for (let p = planes - 1; p >= 0; p--) coded = 256 * coded + bytes[p * n + c * rows + i];
      const change = coded % 2 ? -(coded + 1) / 2 : coded / 2;
      slope = order === 2 ? slope + change : change;
      value += slope;
      out[i * columns + c] = value / per;
    }
  }
  for (let k = 0; k < gaps.length; k += 2) {
    for (let j = gaps[k]; j < gaps[k + 1]; j++) out[(j % rows) * columns + Math.floor(j / rows)] = NaN;
  }
  return out;
}

/** The document, with typed arrays in their places. */
export async function decode(text) {
  const packed = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  const buffer = await inflated(packed);
  const start = 4 + new DataView(buffer).getUint32(0, true);
  const head = new TextDecoder().decode(new Uint8Array(buffer, 4, start - 4));
  return JSON.parse(head, (key, v) => {
    const placed = v !== null && typeof v === "object" && "at" in v && "n" in v;
    if (placed && v.type === "steps") return fromSteps(new Uint8Array(buffer, start + v.at, v.n * v.planes), v);
    return placed && v.type in ARRAYS ? new ARRAYS[v.type](buffer, start + v.at, v.n) : v;
  });
}
