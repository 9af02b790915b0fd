// The stretch from light to colours: that of the program's pictures (include/gamer/image/picture.h and
// picture_colours.h), and others.
// shaders.js has the same formulas in GLSL.

const mostSamples = 2 ** 20;
const blackQuantile = 0.05;
const blackSigmas = 1.645;  // distance of the 5 % quantile below the middle of a Gaussian
const sigmaPerMedian = 1.4826;
const lightSigmas = 3;
const balance = 0.5;
const whiteQuantile = 0.9999;
const referenceLight = 0.8;
const referenceLevel = 0.28;
const middleShare = 0.2;
const middleLevel = 0.54;  // the highest level at the edge of the middle
const leastMiddle = 10;
const groupSigmas = 30;
const mostGrouped = 4096;
const knee = 0.7;  // of pictures with contrast

/// Weight of each plane in red, green and blue. Planes are sorted by wavelength, the longest is
/// red; one plane is grey. `wavelengths` may hold nulls: such planes count as sorted.
export function channelWeights(wavelengths) {
  const count = wavelengths.length;
  if (count === 1) return [[1], [1], [1]];
  const order = wavelengths.map((_, i) => i);
  if (wavelengths.every((w) => w !== null)) order.sort((a, b) => wavelengths[b] - wavelengths[a]);
  const weights = [0, 1, 2].map(() => new Array(count).fill(0));
  if (count === 2) {
    weights[0][order[0]] = 1;
    weights[1] = [0.5, 0.5];
    weights[2][order[1]] = 1;
    return weights;
  }
  for (let channel = 0; channel < 3; ++channel) {
    const first = Math.trunc(channel * count / 3), end = Math.trunc((channel + 1) * count / 3);
    for (let i = first; i < end; ++i) weights[channel][order[i]] = 1 / (end - first);
  }
  return weights;
}

/// The divisor of level() for slope times white; 0 where the stretch is a straight line.
export function steepnessOf(mode, steep) {
  if (mode === 'linear' || !(steep > 1e-6)) return 0;
  return mode === 'log' ? Math.log1p(steep) : Math.asinh(steep);
}

/// Factors that make three channels light per unit wavelength; their product is 1. `planes` have
/// `wavelength` and `zero_point`, `weights` are those of channelWeights(). All are 1 where a plane
/// lacks a number.
export function channelFactors(planes, weights) {
  if (planes.length === 1 || planes.some((plane) => !plane.wavelength || typeof plane.zero_point !== 'number')) return [1, 1, 1];
  const [first] = planes;
  const light = planes.map((plane) =>
      10 ** (-0.4 * (plane.zero_point - first.zero_point)) * (first.wavelength / plane.wavelength) ** 2);
  const factors = weights.map((channel) => channel.reduce((sum, weight, p) => sum + weight * light[p], 0));
  const mean = Math.cbrt(factors[0] * factors[1] * factors[2]);
  return mean > 0 && Number.isFinite(mean) ? factors.map((factor) => factor / mean) : [1, 1, 1];
}

/// Brightness that a mode gives light of `value`: 0 at 0, 1 at `white`.
export function level(mode, value, slope, white) {
  if (!(white > 0)) return 0;
  const steepness = steepnessOf(mode, slope * white);
  if (steepness === 0) return value / white;
  return (mode === 'log' ? Math.log1p(slope * value) : Math.asinh(slope * value)) / steepness;
}

/// The light of brightness `brightness`: the inverse of level().
export function lightOf(mode, brightness, slope, white) {
  const steep = slope * white;
  if (mode === 'linear' || !(steep > 1e-6)) return brightness * white;
  if (mode === 'log') return Math.expm1(brightness * Math.log1p(steep)) / slope;
  return Math.sinh(brightness * Math.asinh(steep)) / slope;
}

/// The slope and the white of the stretch with a look's contrast, and whether it ends in a
/// shoulder. Only Lupton's stretch has contrast (PictureColours).
export function withContrast({mode, contrast, slope}, white) {
  if (mode !== 'lupton' || contrast === 1 || !(white > 0)) return {slope, white, hasShoulder: false};
  const fixed = Math.sinh(referenceLevel * Math.asinh(slope * white)) / contrast;
  return {slope: slope / contrast, white: Math.sinh(Math.asinh(fixed) / referenceLevel) * contrast / slope,
          hasShoulder: contrast > 1};
}

/// Levels above `knee` approach 1 more slowly.
function shoulder(value) {
  return value > knee ? 1 - (1 - knee) * Math.exp((knee - value) / (1 - knee)) : value;
}

/// The light of three channels after sky, balance, exposure, the black handle and saturation.
function balanced(tone, look, rgb) {
  const gain = 2 ** look.exposure;
  const light = rgb.map((value, c) =>
      Math.max(Math.max(value - tone.black[c], 0) * tone.factor[c] * gain - look.black, 0));
  if (look.saturation === 1) return light;
  const mean = (light[0] + light[1] + light[2]) / 3;
  return light.map((value) => Math.max(mean + look.saturation * (value - mean), 0));
}

/// The colour of a pixel, each channel in [0, 1], as displays expect it (sRGB).
export function colour(tone, look, rgb) {
  const light = balanced(tone, look, rgb);
  const {slope, white, hasShoulder} = withContrast(look, Math.max(look.white - look.black, 0));
  let out;
  if (look.mode === 'lupton') {
    const intensity = (light[0] + light[1] + light[2]) / 3;
    if (!(intensity > 0)) return [0, 0, 0];
    const factor = level('asinh', intensity, slope, white) / intensity;
    out = light.map((value) => value * factor);
    const largest = Math.max(...out);
    if (hasShoulder) out = out.map(shoulder);
    else if (largest > 1) out = out.map((value) => value / largest);
  } else {
    out = light.map((value) => Math.min(level(look.mode, value, slope, white), 1));
  }
  return look.gamma === 1 ? out : out.map((value) => value ** (1 / look.gamma));
}

/// A look that shows a tone as the program's pictures do.
export function plainLook(tone) {
  return {mode: 'lupton', slope: tone.slope, white: tone.white, black: 0, exposure: 0, gamma: 1,
          saturation: 1, contrast: 1};
}

/// The number that would stand at `place` if the numbers were sorted. It changes their order (Hoare's
/// selection).
export function selected(numbers, place) {
  let first = 0, last = numbers.length - 1;
  while (first < last) {
    const pivot = numbers[(first + last) >> 1];
    let low = first, high = last;
    while (low <= high) {
      while (numbers[low] < pivot) ++low;
      while (numbers[high] > pivot) --high;
      if (low > high) break;
      const number = numbers[low];
      numbers[low++] = numbers[high];
      numbers[high--] = number;
    }
    if (place <= high) last = high;
    else if (place >= low) first = low;
    else break;
  }
  return numbers[place];
}

function quantile(numbers, fraction) {
  return selected(numbers, Math.trunc(fraction * (numbers.length - 1)));
}

function takeSample(channel, width, stride) {
  const count = Math.ceil(channel.length / stride);
  const values = new Float64Array(count), differences = new Float64Array(count);
  let steps = 0;
  for (let i = 0, next = 0; i < count; ++i, next += stride) {
    values[i] = channel[next];
    if ((next + 1) % width !== 0) differences[steps++] = Math.abs(channel[next + 1] - channel[next]);
  }
  return {values, differences: differences.subarray(0, steps)};
}

function measureSky(sample) {
  const values = sample.values.slice();
  const low = quantile(values, blackQuantile);
  const middle = quantile(values, 0.5);
  let sigma = 0;
  if (sample.differences.length > 0) {
    const differences = sample.differences.slice();
    sigma = Math.min(sigmaPerMedian * quantile(differences, 0.5) / Math.SQRT2,
                     (middle - low) / blackSigmas);
  }
  return {level: low + blackSigmas * sigma, sigma};
}

/// Calls use(light) with value - black of each channel, in the pixels in which some channel exceeds
/// black by `least`. The array is valid until use() returns.
function forEachLight(channels, black, least, use) {
  const light = channels.map(() => 0);
  for (let i = 0; i < channels[0].length; ++i) {
    let isLight = false;
    for (let c = 0; c < channels.length; ++c) {
      light[c] = channels[c][i] - black[c];
      isLight = isLight || light[c] > least[c];
    }
    if (isLight) use(light);
  }
}

/// The value up to which half of the weights lies; NaN without weights.
function weightedMedian(values, weights, count) {
  let whole = 0, low = Infinity, high = -Infinity;
  for (let i = 0; i < count; ++i) {
    whole += weights[i];
    if (!Number.isFinite(values[i])) continue;
    low = Math.min(low, values[i]);
    high = Math.max(high, values[i]);
  }
  const reaches = (limit) => {
    let below = 0;
    for (let i = 0; i < count; ++i) {
      if (values[i] <= limit) below += weights[i];
    }
    return 2 * below >= whole;
  };
  if (!(whole > 0) || !reaches(high)) return NaN;
  if (reaches(low)) return low;
  // Bisection to 1e-9 of the value.
  while (high - low > 1e-9 * high) {
    const middle = (low + high) / 2;
    if (reaches(middle)) {
      high = middle;
    } else {
      low = middle;
    }
  }
  let found = -Infinity;
  for (let i = 0; i < count; ++i) {
    if (values[i] <= high) found = Math.max(found, values[i]);
  }
  return found;
}

/// The excess of green at which half of the light is greener, over groups of successive pixels. A
/// group ends as soon as its noise is small in all channels. 1 where that excess is not a number.
function medianGreen(channels, black, sigma, factor) {
  const size = channels[0].length;
  const excess = new Float64Array(size), light = new Float64Array(size);
  const sum = [0, 0, 0];
  let groups = 0, pixels = 0;
  const endGroup = () => {
    const r = sum[0] * factor[0], g = sum[1] * factor[1], b = sum[2] * factor[2];
    excess[groups] = !(g > 0) ? 0 : r > 0 && b > 0 ? g / Math.sqrt(r * b) : Infinity;
    light[groups++] = Math.max(r + g + b, 0);
    sum[0] = sum[1] = sum[2] = 0;
    pixels = 0;
  };
  forEachLight(channels, black, sigma.map((one) => lightSigmas * one), (own) => {
    const sigmas = groupSigmas * Math.sqrt(++pixels);
    let isClear = true;
    for (let c = 0; c < 3; ++c) {
      sum[c] += own[c];
      isClear = isClear && sum[c] > sigmas * sigma[c];
    }
    if (isClear || pixels === mostGrouped) endGroup();
  });
  if (pixels > 0) endGroup();
  const median = weightedMedian(excess, light, groups);
  return median > 0 ? median : 1;
}

/// The slope for which asinh(slope value)/asinh(slope white) is `level`.
function solveSlope(value, level, white) {
  let low = Math.log(1e-3 / white), high = Math.log(1e30 / white);
  for (let i = 0; i < 100; ++i) {
    const middle = (low + high) / 2, slope = Math.exp(middle);
    if (Math.asinh(slope * value) > level * Math.asinh(slope * white)) {
      high = middle;
    } else {
      low = middle;
    }
  }
  return Math.exp((low + high) / 2);
}

/// The number of the largest of ascending values that sum to a share of their total.
function countAtLight(ascending, share) {
  let total = 0, sum = 0, i = ascending.length;
  for (let k = i; k-- > 0;) total += ascending[k];
  while (i > 0 && sum < share * total) sum += ascending[--i];
  return ascending.length - i;
}

/// The white quantile of ascending values, interpolated between two of them.
function quantileOfWhite(ascending) {
  const last = ascending.length - 1, place = (1 - whiteQuantile) * ascending.length, whole = Math.trunc(place);
  const above = ascending[last - whole], below = ascending[Math.max(last - whole - 1, 0)];
  return above + (place - whole) * (below - above);
}

function chooseStretch(samples, threshold) {
  const size = samples[0].length, lit = new Float64Array(size), largest = new Float64Array(size);
  let count = 0;
  for (let i = 0; i < size; ++i) {
    let sum = 0, peak = 0;
    for (const values of samples) {
      sum += values[i];
      if (values[i] > peak) peak = values[i];
    }
    const intensity = sum / samples.length;
    if (!(intensity > threshold)) continue;
    lit[count] = intensity;
    largest[count++] = peak / intensity;
  }
  if (count === 0) return {slope: 0, scale: 0};
  const sorted = lit.slice(0, count).sort();
  const white = quantileOfWhite(sorted);
  const bright = countAtLight(sorted, referenceLight);
  let slope = solveSlope(sorted[count - bright], referenceLevel, white);
  const middle = middleShare * bright;
  if (middle > leastMiddle * (1 - whiteQuantile) * count) {
    slope = Math.min(slope, solveSlope(sorted[count - 1 - Math.trunc(middle)], middleLevel, white));
  }
  // The largest channel must fit, not the mean: otherwise a red core would be a flat disc.
  for (let i = 0; i < count; ++i) largest[i] *= Math.asinh(slope * lit[i]);
  return {slope, scale: 1 / quantileOfWhite(largest.subarray(0, count).sort())};
}

/// The tone that the program chooses for a picture of these channels: one (grey) or three arrays,
/// red first. `black` and `factor` have three numbers; `white` is the intensity whose brightness
/// is 1, sinh(1/scale)/slope. `factors` are those of channelFactors().
export function automaticTone(channels, width, factors = [1, 1, 1]) {
  const stride = Math.ceil(channels[0].length / mostSamples) || 1;
  const tone = {black: [0, 0, 0], factor: [1, 1, 1], slope: 0, white: 0};
  const samples = [], sigma = [];
  channels.forEach((channel, c) => {
    const sample = takeSample(channel, width, stride);
    const sky = measureSky(sample);
    sigma[c] = sky.sigma;
    tone.black[c] = sky.level;
    samples.push(sample.values);
  });
  const light = channels.map(() => 0);
  forEachLight(samples, tone.black, sigma.map((one) => lightSigmas * one), (own) => {
    for (let c = 0; c < own.length; ++c) light[c] += factors[c] * own[c];
  });
  const mean = light.reduce((sum, value) => sum + value, 0) / light.length;
  light.forEach((value, c) => {
    if (value > 0) tone.factor[c] = (mean / value) ** balance;
  });
  light.forEach((_, c) => { tone.factor[c] *= factors[c]; });
  // Stars differ in redness or blueness, but are never green.
  if (light.length === 3 && Math.min(...light) > 0) {
    tone.factor[1] /= medianGreen(samples, tone.black, sigma, tone.factor);
  }
  let variance = 0;
  samples.forEach((values, c) => {
    for (let i = 0; i < values.length; ++i) {
      values[i] = Math.max(values[i] - tone.black[c], 0) * tone.factor[c];
    }
    if (light[c] > 0) variance += (tone.factor[c] * sigma[c] / light.length) ** 2;
  });
  if (channels.length === 1) {
    tone.black.fill(tone.black[0]);
    tone.factor.fill(tone.factor[0]);
  }
  const {slope, scale} = chooseStretch(samples, lightSigmas * Math.sqrt(variance));
  tone.slope = slope;
  tone.white = scale > 0 ? Math.sinh(1 / scale) / slope : 0;
  return tone;
}
