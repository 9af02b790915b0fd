// A slider's scale: from a declared parameter to positions in [0, 1] and back.

const wide = 20;  // times the default

/// Least and greatest value of a slider, and whether its scale is logarithmic. Without soft bounds
/// they are guessed from interval, default and value.
export function sliderScale(declared, value) {
  const finite = (x) => typeof x === 'number' && Number.isFinite(x);
  const size = Math.abs(declared.default || (finite(declared.default) ? 1 : value) || 1);
  let low = finite(declared.soft_min) ? declared.soft_min : declared.min;
  let high = finite(declared.soft_max) ? declared.soft_max : declared.max;
  // Intervals are far wider than the range of usual values.
  const isWide = (bound) => !finite(bound) || Math.abs(bound) > wide * size;
  if (declared.unit === 'deg' && !finite(low) && !finite(high)) [low, high] = [-180, 180];
  if (!finite(declared.soft_max) && isWide(high)) high = wide / 2 * size;
  if (!finite(declared.soft_min) && (!finite(low) || low < -wide * size)) low = -wide / 2 * size;
  const log = declared.scale === 'log' && high > 0;
  if (log && !(low > 0)) low = high * 1e-4;
  // A value beyond soft bounds stays within reach.
  if (finite(value) && (!log || value > 0)) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (!(high > low)) high = low + 1;
  return {low, high, log, integer: declared.type === 'integer'};
}

/// Position in [0, 1] of a value.
export function positionOf(scale, value) {
  const {low, high, log} = scale;
  const place = log ? Math.log(Math.max(value, low) / low) / Math.log(high / low)
                    : (value - low) / (high - low);
  return Math.min(Math.max(place, 0), 1);
}

/// The value at a position, rounded to the resolution of a slider.
export function valueAt(scale, position) {
  const {low, high, log, integer} = scale;
  if (position <= 0) return low;
  if (position >= 1) return high;
  if (log) {
    const value = low * (high / low) ** position;
    return integer ? Math.round(value) : Number(value.toPrecision(3));
  }
  const value = low + (high - low) * position;
  if (integer) return Math.round(value);
  const digits = Math.max(0, 3 - Math.floor(Math.log10(high - low)) - 1);
  return Number(value.toFixed(Math.min(digits, 12)));
}

/// A number for people: six digits at most.
export function text(value) {
  if (typeof value !== 'number') return String(value ?? '');
  if (Number.isInteger(value)) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) return value.toExponential(3).replace(/\.?0+e/, 'e');
  return String(Number(value.toPrecision(6)));
}
