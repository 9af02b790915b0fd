// Right ascension and declination of a pixel, for the zenithal projections of the FITS standard
// (Calabretta & Greisen 2002, A&A 395, 1077) with a CD or PC matrix.

const degree = Math.PI / 180;

/// Distance from the pole of a projected radius, both in degrees; NaN outside the sky.
const latitudes = {
  TAN: (r) => 90 - Math.atan(r * degree) / degree,
  SIN: (r) => Math.acos(r * degree) / degree,
  ARC: (r) => 90 - r,
  STG: (r) => 90 - 2 * Math.atan(r * degree / 2) / degree,
  ZEA: (r) => 90 - 2 * Math.asin(r * degree / 2) / degree,
};

/// A function from a pixel (x, y), counted from 1, to {ra, dec} in degrees or null. Null where the
/// header is none or has another projection.
export function skyOf(header) {
  if (!header || typeof header.CTYPE1 !== 'string' || !header.CTYPE1.startsWith('RA---')) return null;
  const latitude = latitudes[header.CTYPE1.slice(5, 8)];
  if (!latitude) return null;
  const number = (key, other) => typeof header[key] === 'number' ? header[key] : other;
  const matrix = [[1, 1], [1, 2], [2, 1], [2, 2]].map(([i, j]) => {
    const cd = number(`CD${i}_${j}`, null);
    if (cd !== null) return cd;
    if ('CD1_1' in header) return 0;
    return number(`CDELT${i}`, 1) * number(`PC${i}_${j}`, i === j ? 1 : 0);
  });
  const ra0 = number('CRVAL1', 0) * degree, dec0 = number('CRVAL2', 0) * degree;
  return (x, y) => {
    const dx = x - number('CRPIX1', 0), dy = y - number('CRPIX2', 0);
    const u = matrix[0] * dx + matrix[1] * dy, v = matrix[2] * dx + matrix[3] * dy;
    const theta = latitude(Math.hypot(u, v)) * degree;
    if (Number.isNaN(theta)) return null;
    const phi = Math.atan2(u, -v) - Math.PI;  // with LONPOLE = 180
    const sin = Math.sin(theta) * Math.sin(dec0) + Math.cos(theta) * Math.cos(dec0) * Math.cos(phi);
    const ra = ra0 + Math.atan2(-Math.cos(theta) * Math.sin(phi),
        Math.sin(theta) * Math.cos(dec0) - Math.cos(theta) * Math.sin(dec0) * Math.cos(phi));
    return {ra: ((ra / degree) % 360 + 360) % 360, dec: Math.asin(Math.min(Math.max(sin, -1), 1)) / degree};
  };
}
