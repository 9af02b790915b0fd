// Shares of a galaxy's light. Where every component of light has a `fraction`, they sum to 1.

/// Indices of components whose light has a share.
export function sharing(components) {
  return components.flatMap((component, i) =>
      typeof component.values.fraction === 'number' && component.values.active !== false ? [i] : []);
}

/// Whether the shares must sum to 1: no component has an intensity instead.
export function mustSum(components) {
  return !components.some((component) => component.values.active !== false &&
      component.given.includes('intensity') && !component.given.includes('fraction'));
}

function rounded(value) { return Number(value.toPrecision(6)); }

/// Edits that give the component `index` the share `value` and scale the others', so that their sum
/// stays 1. With index null the shares that are there are scaled.
export function shareEdits(components, index, value = 0) {
  const set = (i, share) => ({set: [i, 'fraction', share]});
  if (!mustSum(components)) return index === null ? [] : [set(index, value)];
  const others = sharing(components).filter((i) => i !== index);
  if (index !== null && others.length === 0) return [set(index, 1)];
  const total = others.reduce((sum, i) => sum + components[i].values.fraction, 0);
  const own = index === null ? 0 : Math.min(rounded(value), rounded(1 - 1e-4 * others.length));
  let left = 1 - own;
  const edits = index === null ? [] : [set(index, own)];
  others.forEach((i, place) => {
    const is_last = place === others.length - 1;
    const share = is_last ? Number(left.toFixed(9)) :
        rounded((1 - own) * components[i].values.fraction / total);
    left -= share;
    edits.push(set(i, share));
  });
  return edits;
}

/// Factor of each component's light between two states of the galaxy with the same components.
export function shareFactors(before, after) {
  return before.map((component, i) => {
    const old = component.values.fraction, now = after[i]?.values.fraction;
    return typeof old === 'number' && typeof now === 'number' && old > 0 ? now / old : 1;
  });
}
