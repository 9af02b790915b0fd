// Binary messages of the server: uint32 length of the header, little endian, a JSON header padded
// with spaces to a multiple of 4 bytes, then float32 planes (plane, y, x; row 0 at the bottom). A
// strip has only `rows` rows from `row` on. The message after the last strip has no rows. Drafts
// have packed slices of half-precision numbers in place of planes.

/// The header and the planes of a message. Throws RangeError for a message that is cut short or
/// too long.
export function parseFrame(buffer) {
  if (buffer.byteLength < 4) throw new RangeError('a frame without a header');
  const length = new DataView(buffer).getUint32(0, true);
  const start = 4 + length;
  if (length > buffer.byteLength - 4 || start % 4 !== 0) {
    throw new RangeError('a frame with a header of a wrong length');
  }
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  if (header.axes) return draftSlices(header, buffer, start);
  const size = header.width * (header.rows ?? header.height), count = header.planes.length;
  if (buffer.byteLength - start !== 4 * size * count) {
    throw new RangeError(`a frame of ${buffer.byteLength - start} bytes; its header promises ` +
                         `${4 * size * count}`);
  }
  const values = new Float32Array(buffer, start, size * count);
  return {header, values, plane: (i) => values.subarray(i * size, (i + 1) * size)};
}

/// Slices of a draft as they were sent: unpackSlices() has their numbers.
function draftSlices(header, buffer, start) {
  return {header, packed: new Uint8Array(buffer, start)};
}

async function inflated(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/// The half-precision numbers of packed slices (src/studio/draft_bytes.h): four a voxel, then two
/// where its dust has variants. Throws RangeError for slices of another size.
export async function unpackSlices({header, packed}) {
  const [nx, ny] = header.axes.map((axis) => axis.nodes), voxels = nx * ny * header.slices;
  const codes = await inflated(packed), numbers = voxels * (header.variants ? 6 : 4);
  if (codes.length !== 2 * numbers) {
    throw new RangeError(`a draft of ${codes.length} bytes; its header promises ${2 * numbers}`);
  }
  const halves = new Uint16Array(4 * voxels), variants = header.variants ? new Uint16Array(2 * voxels) : null;
  let at = 0;
  const put = (to, number, step, base, baseStep) => {
    let before = 0;
    for (let i = 0; i < voxels; ++i, ++at) {
      const folded = codes[at] << 8 | codes[numbers + at];
      before = (i % nx === 0 ? 0 : before) + (folded & 1 ? -(folded + 1 >> 1) : folded >> 1);
      to[step * i + number] = (before << 4) + (base < 0 ? 0 : halves[baseStep * i + base]);
    }
  };
  for (let number = 0; number < 4; ++number) put(halves, number, 4, number === 1 || number === 2 ? 0 : -1, 4);
  for (let number = 0; variants && number < 2; ++number) put(variants, number, 2, 3, 4);
  return {header, halves, variants};
}
