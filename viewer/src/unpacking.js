// Takes apart what omniroll/viewer/packing.py has packed.

const TYPES = { f8: Float64Array, f4: Float32Array, i4: Int32Array, u1: Uint8Array };

/** The bytes (ArrayBuffer) of base64 of deflate. */
export async function inflated(base64) {
  const text = atob(base64.trim());
  const bytes = Uint8Array.from(text, (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Response(stream).arrayBuffer();
}

/** The description and the arrays by name. */
export function unpacked(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const description = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  for (const [name, { type, shape, offset }] of Object.entries(description.arrays)) {
    arrays[name] = ordered(new Uint8Array(buffer, 4 + length + offset), TYPES[type], shape);
  }
  return { description, arrays };
}

/** The numbers of an array whose first bytes stand first, then all second bytes, and so on. */
function ordered(bytes, Type, shape) {
  const count = shape.reduce((product, size) => product * size, 1);
  const size = Type.BYTES_PER_ELEMENT;
  const numbers = new Uint8Array(count * size);
  for (let part = 0; part < size; part++) {
    for (let k = 0; k < count; k++) numbers[k * size + part] = bytes[part * count + k];
  }
  return new Type(numbers.buffer);
}
