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

/** The document, with typed arrays in their places. */
export async function decode(text) {
  const packed = Uint8Array.from(atob(text.trim()), (c) => c.charCodeAt(0));
  const buffer = await inflated(packed);
  const start = 4 + new DataView(buffer).getUint32(0, true);
  const head = new TextDecoder().decode(new Uint8Array(buffer, 4, start - 4));
  return JSON.parse(head, (key, v) => {
    const isArray = v !== null && typeof v === "object" && "at" in v && "n" in v && v.type in ARRAYS;
    return isArray ? new ARRAYS[v.type](buffer, start + v.at, v.n) : v;
  });
}
