// Binary messages of the server: uint32 length of the header, little endian, a JSON header padded
// with spaces to a multiple of 4 bytes, then float32 planes (plane, y, x; row 0 at the bottom). A strip
// has `rows` rows from `row` instead of all. Drafts have slices of half-precision numbers instead.

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

/// Slices of a draft: four half-precision numbers a voxel, then two where its dust has variants.
function draftSlices(header, buffer, start) {
  const voxels = header.axes[0].nodes * header.axes[1].nodes * header.slices;
  const bytes = voxels * (header.variants ? 12 : 8);
  if (buffer.byteLength - start !== bytes) {
    throw new RangeError(`a draft of ${buffer.byteLength - start} bytes; its header promises ${bytes}`);
  }
  return {header, halves: new Uint16Array(buffer, start, 4 * voxels),
          variants: header.variants ? new Uint16Array(buffer, start + 8 * voxels, 2 * voxels) : null};
}
