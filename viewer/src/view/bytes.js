// Typed arrays from base64, as studies/packed.h writes them: little-endian, as every browser's machine is.

function bytesOf(text) {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; ++i) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

export const uint8 = bytesOf;
export const uint16 = (text) => new Uint16Array(bytesOf(text).buffer);
export const uint32 = (text) => new Uint32Array(bytesOf(text).buffer);
export const float32 = (text) => new Float32Array(bytesOf(text).buffer);

/** [x, y, z] of each point. */
export function points(text) {
  const flat = float32(text);
  return Array.from({length: flat.length / 3}, (_, i) => [flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]]);
}
