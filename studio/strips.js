// Strips of a frame that is not finished: rows of the fine level, over the coarser frame that is
// shown. The message after the last strip has no rows.

function frameOf(header, values) {
  const size = header.width * header.height;
  return {header: {...header, row: 0, rows: header.height, isPartial: true}, values,
          plane: (i) => values.subarray(i * size, (i + 1) * size)};
}

/// A frame of a strip's size without light.
export function empty(header) {
  return frameOf(header, new Float32Array(header.width * header.height * header.planes.length));
}

/// The place of each plane of a header in a frame with the same planes; null where one is missing.
function placesOf(header, frame) {
  const key = ({label, component}) => `${component}/${label}`;
  const known = new Map(frame.header.planes.map((plane, i) => [key(plane), i]));
  const places = header.planes.map((plane) => known.get(key(plane)));
  return places.includes(undefined) ? null : places;
}

/// A frame of the strip's size that shows another frame by its nearest pixels; null where their
/// planes differ.
export function enlarged(header, frame) {
  const places = placesOf(header, frame);
  if (!places) return null;
  const {width, height} = header, size = width * height;
  const values = new Float32Array(size * places.length);
  const columns = Array.from({length: width}, (_, x) => Math.floor((x + 0.5) * frame.header.width / width));
  places.forEach((place, i) => {
    const from = frame.plane(place);
    let before = -1;
    for (let y = 0; y < height; ++y) {
      const row = Math.floor((y + 0.5) * frame.header.height / height) * frame.header.width;
      const to = i * size + y * width;
      if (row === before) values.copyWithin(to, to - width, to);
      else for (let x = 0; x < width; ++x) values[to + x] = from[row + columns[x]];
      before = row;
    }
  });
  return frameOf({...frame.header, ...header}, values);
}

/// Whether a header is that of the message after the last strip.
export function isEnd(header) { return header.rows === 0; }

/// The frame that all strips have filled, with the header of the message after them.
export function completed(frame, header) {
  const {height} = frame.header;
  Object.assign(frame.header, header, {row: 0, rows: height, isPartial: false});
  return frame;
}

/// Writes a strip's rows into a frame of its size.
export function putStrip(frame, strip) {
  const {width, height, row, rows} = strip.header;
  for (let i = 0; i < strip.header.planes.length; ++i) {
    frame.values.set(strip.plane(i), i * width * height + row * width);
  }
}
