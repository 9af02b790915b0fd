// The camera's path through key frames, as the program moves it (section [animation]): cubic
// Hermite curves whose slopes are those of parabolas through three key frames.

import {basis, cross, normalize, scale, subtract} from './view.js';

/// A smooth curve through values (numbers or vectors as arrays) at ascending times.
export function smoothPath(times, values) {
  const count = values.length;
  const isVector = Array.isArray(values[0]);
  const lists = values.map((value) => isVector ? value : [value]);
  const slopes = lists.map(() => []);
  for (let c = 0; c < lists[0].length; ++c) {
    const at = (i) => lists[i][c];
    const lengths = [], rates = [];
    for (let i = 0; i + 1 < count; ++i) {
      lengths.push(times[i + 1] - times[i]);
      rates.push((at(i + 1) - at(i)) / lengths[i]);
    }
    for (let i = 0; i < count && count > 1; ++i) {
      if (count === 2) {
        slopes[i][c] = rates[0];
        continue;
      }
      const k = Math.min(Math.max(i, 1), count - 2);
      const bend = (rates[k] - rates[k - 1]) / (lengths[k - 1] + lengths[k]);
      const middle = rates[k - 1] + bend * lengths[k - 1];
      slopes[i][c] = middle + bend * 2 * (times[i] - times[k]);
    }
  }
  return (time) => {
    if (count === 1) return values[0];
    let i = 0;
    while (i + 2 < count && times[i + 1] <= time) ++i;
    const span = times[i + 1] - times[i];
    const s = (time - times[i]) / span, r = 1 - s;
    const result = lists[0].map((_, c) =>
        lists[i][c] * (r * r * (1 + 2 * s)) + slopes[i][c] * (r * r * s * span) +
        lists[i + 1][c] * (s * s * (1 + 2 * r)) - slopes[i + 1][c] * (s * s * r * span));
    return isVector ? result : result[0];
  };
}

// Quaternions [w, x, y, z].

const multiply = (a, b) => [
  a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
  a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
  a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
  a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]];
const turned = (q, v) => multiply(multiply(q, [0, ...v]), [q[0], -q[1], -q[2], -q[3]]).slice(1);
const dotted = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);

/// The turn from x, y, z to right, up, back of a camera.
function turnOf(camera) {
  const {right: x, up: y, back: z} = basis(camera);
  const trace = x[0] + y[1] + z[2];
  if (trace > 0) return normalize([1 + trace, y[2] - z[1], z[0] - x[2], x[1] - y[0]]);
  if (x[0] > y[1] && x[0] > z[2]) {
    return normalize([y[2] - z[1], 1 + x[0] - y[1] - z[2], y[0] + x[1], z[0] + x[2]]);
  }
  if (y[1] > z[2]) return normalize([z[0] - x[2], y[0] + x[1], 1 + y[1] - x[0] - z[2], z[1] + y[2]]);
  return normalize([x[1] - y[0], z[0] + x[2], z[1] + y[2], 1 + z[2] - x[0] - y[1]]);
}

const hasOneUp = (keys) => keys.every((key) => String(key.camera.up) === String(keys[0].camera.up));

/// The direction that is up at a time: the turns of the key frames, then the shortest turn to the
/// view.
function upAt(keys, times, time, view) {
  if (hasOneUp(keys)) return keys[0].camera.up;
  const turns = [];
  for (const {camera} of keys) {
    const turn = turnOf(camera), last = turns[turns.length - 1];
    turns.push(last && dotted(last, turn) < 0 ? scale(turn, -1) : turn);
  }
  const turn = normalize(smoothPath(times, turns)(time));
  const from = turned(turn, [0, 0, -1]), to = normalize(subtract(view.target, view.position));
  const shortest = normalize([1 + dotted(from, to), ...cross(from, to)]);
  return turned(shortest, turned(turn, [0, 1, 0]));
}

/// The camera at a time between key frames [{time, camera}]. All have one projection.
export function cameraAt(keys, time) {
  const times = keys.map((key) => key.time);
  const path = (name) => smoothPath(times, keys.map((key) => key.camera[name]))(time);
  const logarithm = (name) =>
      Math.exp(smoothPath(times, keys.map((key) => Math.log(key.camera[name])))(time));
  const camera = {...keys[0].camera, position: path('position'), target: path('target')};
  camera.up = upAt(keys, times, time, camera);
  if (camera.projection === 'orthographic') camera.width = logarithm('width');
  if (camera.projection === 'perspective') camera.fov = logarithm('fov');
  return camera;
}

/// Section [animation] of these key frames, as settings.
export function animationSettings(keys, frames) {
  const all = (name) => keys.flatMap((key) => key.camera[name]);
  const settings = {
    'animation.frames': frames,
    'animation.times': keys.map((key) => key.time),
    'animation.position': all('position'),
    'animation.target': all('target'),
  };
  if (!hasOneUp(keys)) settings['animation.up'] = all('up');
  const {projection} = keys[0].camera;
  if (projection === 'orthographic') settings['animation.width'] = all('width');
  if (projection === 'perspective') settings['animation.fov'] = all('fov');
  return settings;
}

/// The reason why these key frames make no film; an empty text if they make one.
export function animationProblem(keys) {
  if (keys.length < 2) return 'A film needs two key frames.';
  const kinds = new Set(keys.map((key) => key.camera.projection));
  if (kinds.has('sky')) return 'A sky view has no moving camera.';
  if (kinds.size > 1) return 'All key frames need one projection.';
  return '';
}
