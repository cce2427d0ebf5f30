// Tables of numbers as the page holds them: codes of equal steps in the logarithm, deflated, as base64.

/** The bytes that a base64 text stands for. */
function bytesOf(text) {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * A table: value(i) = 0 where codes[i] is 0, else lowest * exp((codes[i] - 1) * step).
 *
 * The bytes are two planes, low bytes first, of the differences from one code to the next, folded so that small ones of
 * either sign are small (zigzag).
 */
export async function readTable(packed) {
  const planes = await inflated(bytesOf(packed.data));
  const length = packed.shape.reduce((product, n) => product * n, 1);
  if (planes.length !== 2 * length) throw new Error(`a table of ${length} numbers has ${planes.length} bytes`);
  const codes = new Uint16Array(length);
  let code = 0;
  for (let i = 0; i < length; i++) {
    const folded = planes[i] | (planes[length + i] << 8);
    code = (code + ((folded >> 1) ^ -(folded & 1))) & 0xffff;
    codes[i] = code;
  }
  let most = 0;
  for (const one of codes) if (one > most) most = one;
  const values = new Float64Array(most + 1);
  for (let i = 1; i <= most; i++) values[i] = packed.lowest * Math.exp((i - 1) * packed.step);
  return { shape: packed.shape, codes, values };
}

/** A table of one number. */
export function constantTable(value, axes) {
  return { shape: Array(axes).fill(1), codes: new Uint16Array([1]), values: new Float64Array([0, value]) };
}
