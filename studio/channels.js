// Which planes are red, green and blue.

import {channelWeights} from './stretch.js';

/// The spectral planes of a frame, each once: those of components share labels.
export function spectralPlanes(header) {
  const known = new Map();
  for (const plane of header.planes) if (!known.has(plane.label)) known.set(plane.label, plane);
  return [...known.values()];
}

/// Weights of each spectral plane in red, green and blue: chosen by label, or those of the program's
/// pictures.
export function channelsOf(header, chosen) {
  const planes = spectralPlanes(header);
  const names = planes.map((plane) => plane.label);
  const isChosen = chosen !== null && chosen.every((name) => names.includes(name));
  const weights = isChosen ? chosen.map((name) => names.map((other) => other === name ? 1 : 0))
                           : channelWeights(planes.map((plane) => plane.wavelength ?? null));
  const isGrey = isChosen ? new Set(chosen).size === 1 : names.length === 1;
  return {names, weights, isGrey};
}

/// Weights [red, green, blue] of every plane of a frame. `share(component)` is the factor of a
/// component's light, 0 where it is muted.
export function planeWeights(header, chosen, share) {
  const {names, weights} = channelsOf(header, chosen);
  return header.planes.map((plane) => {
    const spectral = names.indexOf(plane.label);
    const factor = plane.component === null || plane.component === undefined ? 1 : share(plane.component);
    return weights.map((channel) => channel[spectral] * factor);
  });
}

/// Values of the spectral planes in a pixel of a frame.
export function valuesAt(frame, x, y, share) {
  const {header} = frame, at = y * header.width + x;
  const sums = new Map();
  header.planes.forEach((plane, i) => {
    const factor = plane.component === null || plane.component === undefined ? 1 : share(plane.component);
    sums.set(plane.label, (sums.get(plane.label) ?? 0) + (factor === 0 ? 0 : factor * frame.plane(i)[at]));
  });
  return [...sums].map(([name, value]) => ({name, value, unit: header.planes.find((p) => p.label === name).unit}));
}
