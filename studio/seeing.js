// A Gaussian point-spread function and Gaussian noise over the picture, as `gutil convolve --psf
// gaussian` and `gutil noise --sigma` apply them to a file.

const most = 48;  // half-width of the kernel, pixels
const energy = 0.999;

/// Weights of the pixels 0, 1, 2... from the middle of a Gaussian of this FWHM in pixels, integrated
/// over pixels, so far that 99.9 % of the light is within. The sum over both sides is 1.
export function gaussianKernel(fwhm) {
  const exponent = 4 * Math.LN2 / (fwhm * fwhm);
  const radius = Math.sqrt(-Math.log(1 - energy) / exponent);
  const half = Math.min(Math.max(Math.ceil(radius - 0.5), 0), most);
  const pieces = Math.max(32, Math.ceil(32 / fwhm));
  const weights = [];
  for (let i = 0; i <= half; ++i) {
    // Simpson's rule over the pixel.
    let sum = 0;
    for (let k = 0; k <= 2 * pieces; ++k) {
      const x = i - 0.5 + k / (2 * pieces);
      sum += (k === 0 || k === 2 * pieces ? 1 : k % 2 === 1 ? 4 : 2) * Math.exp(-exponent * x * x);
    }
    weights.push(sum);
  }
  const total = weights.reduce((sum, weight, i) => sum + (i === 0 ? weight : 2 * weight), 0);
  return weights.map((weight) => weight / total);
}

/// PSF and noise for a frame whose width is `part` of the image's width. A pixel of the frame is
/// the mean of several pixels of the image, so that its noise is less. Null without PSF and noise.
export function seeingOf(look, part) {
  const fwhm = (look.psf ?? 0) * part, noise = (look.noise ?? 0) * part;
  if (!(fwhm >= 0.05) && !(noise > 0)) return null;
  return {kernel: fwhm >= 0.05 ? gaussianKernel(fwhm) : [1], noise};
}

export const kernelLength = most + 1;
