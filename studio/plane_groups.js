// Groups of planes whose weights change alike. When a share of light moves, one component is scaled
// by one factor and all others by another factor. The picture is then a weighted sum of two sums of
// planes, which are made once.

// Relative difference of factors that count as equal; shares have six digits.
const sameFactor = 2e-5;

/// Compares weights [red, green, blue] of planes with those of `base`. Returns the common factor of
/// each group and the group of each plane. Returns null where more than two factors are needed, and
/// where a plane had no weight before.
export function planeGroups(base, weights) {
  const factors = [], groups = [];
  if (base.length !== weights.length) return null;
  for (let plane = 0; plane < base.length; ++plane) {
    const channel = base[plane].findIndex((weight) => weight !== 0);
    const factor = channel < 0 ? factors[0] ?? 1 : weights[plane][channel] / base[plane][channel];
    const isAlike = (weight, c) => Math.abs(weight - factor * base[plane][c]) <= sameFactor * Math.abs(weight);
    if (!weights[plane].every(isAlike)) return null;
    let group = factors.findIndex((known) => Math.abs(factor - known) <= sameFactor * Math.abs(known));
    if (group < 0) group = factors.push(factor) - 1;
    if (group > 1) return null;
    groups.push(group);
  }
  return {factors: [factors[0] ?? 1, factors[1] ?? 0], groups};
}
