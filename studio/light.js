// Shares of a galaxy's light. Where every component of light has a `fraction`, they sum to 1.

/// Indices of components whose light has a share.
export function sharing(components) {
  return components.flatMap((component, i) =>
      typeof component.values.fraction === 'number' && component.values.active !== false ? [i] : []);
}

/// Whether the shares must sum to 1. They must where every active component of light has a share;
/// a component without a share has an intensity, given or by default.
function mustSum(components) {
  return !components.some(({values}) =>
      values.active !== false && 'fraction' in values && typeof values.fraction !== 'number');
}

/// Edits of shares in a galaxy in which other components have an intensity. These components get
/// the rest of the light, so that the shares sum to less than 1.
function looseEdits(components, index, value) {
  const set = (i, share) => ({set: [i, 'fraction', rounded(share)]});
  const others = sharing(components).filter((i) => i !== index);
  const total = others.reduce((sum, i) => sum + components[i].values.fraction, 0);
  if (index !== null) return [set(index, Math.min(value, 0.99 * (1 - total)))];
  return total < 1 ? [] : others.map((i) => set(i, 0.95 * components[i].values.fraction / total));
}

function changed(components, index, key, value) {
  return components.map((component, i) =>
      i === index ? {...component, values: {...component.values, [key]: value}} : component);
}

function rounded(value) { return Number(value.toPrecision(6)); }

/// Edits that give the component `index` the share `value`, and scale the shares of the others so
/// that the sum stays 1. With index null all shares are scaled.
export function shareEdits(all, index, value = 0) {
  const components = index === null ? all : changed(all, index, 'fraction', value);
  const set = (i, share) => ({set: [i, 'fraction', share]});
  if (!mustSum(components)) return looseEdits(components, index, value);
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

/// Edits that give a parameter of a component a value, with the edits of shares that follow. Light
/// has a share or an intensity, and an inactive component has no share.
export function valueEdits(components, index, key, value) {
  const drop = (name) => components[index].given.includes(name) ? [{reset: [index, name]}] : [];
  const set = {set: [index, key, value]};
  switch (key) {
    case 'fraction': return [...drop('intensity'), ...shareEdits(components, index, value)];
    case 'intensity': return [...drop('fraction'), set];
    case 'active': return [set, ...shareEdits(changed(components, index, 'active', value), null)];
    default: return [set];
  }
}

/// Factor of each component's light between two states of the galaxy with the same components.
export function shareFactors(before, after) {
  return before.map((component, i) => {
    const old = component.values.fraction, now = after[i]?.values.fraction;
    return typeof old === 'number' && typeof now === 'number' && old > 0 ? now / old : 1;
  });
}
