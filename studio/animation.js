// The camera's path through key frames, as the program moves it (section [animation]): cubic
// Hermite curves whose slopes are those of parabolas through three key frames.

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

/// The camera at a time between key frames [{time, camera}]. All have one projection; `up` is that
/// of the first.
export function cameraAt(keys, time) {
  const times = keys.map((key) => key.time);
  const path = (name) => smoothPath(times, keys.map((key) => key.camera[name]))(time);
  const logarithm = (name) =>
      Math.exp(smoothPath(times, keys.map((key) => Math.log(key.camera[name])))(time));
  const first = keys[0].camera;
  const camera = {...first, position: path('position'), target: path('target')};
  if (first.projection === 'orthographic') camera.width = logarithm('width');
  if (first.projection === 'perspective') camera.fov = logarithm('fov');
  return camera;
}

/// Section [animation] of these key frames, as settings.
export function animationSettings(keys, frames) {
  const all = (name) => keys.flatMap((key) => key.camera[name]);
  const first = keys[0].camera;
  const settings = {
    'animation.frames': frames,
    'animation.times': keys.map((key) => key.time),
    'animation.position': all('position'),
    'animation.target': all('target'),
  };
  if (first.projection === 'orthographic') settings['animation.width'] = all('width');
  if (first.projection === 'perspective') settings['animation.fov'] = all('fov');
  return settings;
}

/// What forbids a film of these key frames, or an empty text.
export function animationProblem(keys) {
  if (keys.length < 2) return 'A film needs two key frames.';
  const kinds = new Set(keys.map((key) => key.camera.projection));
  if (kinds.has('sky')) return 'A sky view has no moving camera.';
  if (kinds.size > 1) return 'All key frames need one projection.';
  return '';
}
