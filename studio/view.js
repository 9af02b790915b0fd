// The camera: orbit, pan, zoom and centre, as pure functions of the keys of section [camera].

const nearestPole = 0.01;  // radians between the view and `up`

export const add = (a, b) => a.map((value, i) => value + b[i]);
export const subtract = (a, b) => a.map((value, i) => value - b[i]);
export const scale = (a, s) => a.map((value) => value * s);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a) => Math.hypot(...a);
export const normalize = (a) => scale(a, 1 / length(a));
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                a[0] * b[1] - a[1] * b[0]];

/// v turned about a unit axis by an angle (Rodrigues).
export function turn(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return add(add(scale(v, c), scale(cross(axis, v), s)), scale(axis, dot(axis, v) * (1 - c)));
}

/// Right, up and back of the image, unit vectors.
export function basis(camera) {
  const back = normalize(subtract(camera.position, camera.target));
  const right = normalize(cross(normalize(camera.up), back));
  return {right, up: cross(back, right), back};
}

export const isSky = (camera) => camera.projection === 'sky';
export const isFlat = (camera) => camera.projection === 'orthographic' || camera.projection === 'perspective';

/// Whether an inclination, relative to the camera, means another orientation after this change.
export function turnsGalaxies(before, after) {
  if (isSky(before) || isSky(after)) return false;
  const seen = ({projection, position, target, up}) => {
    const way = subtract(position, target);
    return projection === 'orthographic' ? [...normalize(way), ...up] : [...position, ...target, ...up];
  };
  const from = seen(before), to = seen(after);
  return from.length !== to.length || from.some((value, i) => Math.abs(value - to[i]) > 1e-9);
}

/// Scene units across the image in the plane of the target.
export function across(camera) {
  if (camera.projection === 'orthographic') return camera.width;
  return 2 * Math.tan(camera.fov * Math.PI / 360) * length(subtract(camera.position, camera.target));
}

const tidy = (vector) => vector.map((value) => Number(value.toPrecision(9)));

/// The camera around its target by angles: `right` about `up`, `over` above the horizon. Panoramas
/// turn about themselves instead.
export function orbit(camera, right, over) {
  if (isSky(camera)) return camera;
  const axes = basis(camera);
  const pole = normalize(camera.up);
  const height = Math.acos(Math.min(Math.max(dot(axes.back, pole), -1), 1));
  const rise = Math.min(Math.max(over, height - Math.PI + nearestPole), height - nearestPole);
  const moved = (v) => turn(turn(v, axes.right, -rise), pole, -right);
  const way = subtract(camera.position, camera.target);
  if (!isFlat(camera)) return {...camera, target: tidy(subtract(camera.position, moved(way)))};
  return {...camera, position: tidy(add(camera.target, moved(way)))};
}

/// The image turned by an angle about its middle.
export function roll(camera, angle) {
  if (isSky(camera)) return {...camera, rotation: (camera.rotation + angle * 180 / Math.PI) % 360};
  const {up, back} = basis(camera);
  return {...camera, up: tidy(turn(up, back, angle))};
}

/// The picture follows the pointer by (dx, dy), in units of the image's width, y upwards.
/// `pixels` is the width of the full image.
export function pan(camera, dx, dy, pixels) {
  if (isSky(camera)) return panSky(camera, dx, dy, pixels);
  if (!isFlat(camera)) return orbit(camera, dx, dy);
  const {right, up} = basis(camera);
  const shift = add(scale(right, -dx * across(camera)), scale(up, -dy * across(camera)));
  return {...camera, position: tidy(add(camera.position, shift)), target: tidy(add(camera.target, shift))};
}

function panSky(camera, dx, dy, pixels) {
  const step = camera.pixel_scale * pixels / 3600;
  const angle = camera.rotation * Math.PI / 180;
  // +y points to the position angle `rotation` from North to East; East is left.
  const east = dx * Math.cos(angle) - dy * Math.sin(angle);
  const north = -dx * Math.sin(angle) - dy * Math.cos(angle);
  const dec = Math.min(Math.max(camera.center[1] + north * step, -90), 90);
  const ra = camera.center[0] + east * step / Math.max(Math.cos(dec * Math.PI / 180), 1e-6);
  return {...camera, center: tidy([(ra + 360) % 360, dec])};
}

/// The field of view times a factor.
export function zoom(camera, factor) {
  const bounded = (value, low, high) => Number(Math.min(Math.max(value, low), high).toPrecision(9));
  switch (camera.projection) {
    case 'sky': return {...camera, pixel_scale: bounded(camera.pixel_scale * factor, 1e-7, 1e6)};
    case 'orthographic': return {...camera, width: bounded(camera.width * factor, 1e-6, 1e12)};
    case 'perspective': {
      const way = subtract(camera.position, camera.target);
      return {...camera, position: tidy(add(camera.target, scale(way, factor)))};
    }
    case 'fisheye': return {...camera, fov: bounded(camera.fov * factor, 1, 360)};
    default: return camera;
  }
}

/// The zoom that keeps the place (x, y) of the image, in units of its width from the middle.
export function zoomAt(camera, factor, x, y, pixels) {
  if (!isFlat(camera) && !isSky(camera)) return zoom(camera, factor);
  const moved = pan(camera, -x * (1 - factor), -y * (1 - factor), pixels);
  return zoom(moved, factor);
}

/// The camera with the place (x, y) in the middle.
export function centre(camera, x, y, pixels) {
  if (!isFlat(camera) && !isSky(camera)) return orbit(camera, -x, -y);
  return pan(camera, -x, -y, pixels);
}

/// The point at the place (x, y) in the plane through the target, or null for other cameras.
export function pointAt(camera, x, y) {
  if (!isFlat(camera)) return null;
  const {right, up} = basis(camera);
  const width = across(camera);
  return add(camera.target, add(scale(right, x * width), scale(up, y * width)));
}

/// The camera from the direction `from` with `up` up, at its distance.
export function lookFrom(camera, from, up) {
  if (isSky(camera)) return camera;
  const distance = length(subtract(camera.position, camera.target));
  return {...camera, position: tidy(add(camera.target, scale(normalize(from), distance))), up};
}

/// The direction v of a galaxy with axis z after the shortest turn of the galaxy from z to `pole`.
export function alongPole(v, pole) {
  const o = normalize(pole), across = [-o[1], o[0], 0], sine = length(across);
  if (sine > 0) return turn(v, scale(across, 1 / sine), Math.atan2(sine, o[2]));
  return o[2] > 0 ? v : [v[0], -v[1], -v[2]];
}

/// The keys of section [camera] that a camera has, as settings.
export function cameraSettings(camera) {
  const keys = {
    sky: ['center', 'pixel_scale', 'rotation'],
    orthographic: ['position', 'target', 'up', 'width'],
    perspective: ['position', 'target', 'up', 'fov'],
    fisheye: ['position', 'target', 'up', 'fov'],
  }[camera.projection] ?? ['position', 'target', 'up'];
  return Object.fromEntries([['camera.projection', camera.projection],
                             ...keys.map((key) => [`camera.${key}`, camera[key]])]);
}
