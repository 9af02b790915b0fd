#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gamer {

/// How values between pixels are found. x in pixels, k(x) = 0 beyond the radius.
enum class Kernel {
  nearest,   ///< the pixel that is hit; radius 1/2
  area,      ///< exact overlap of pixels; resample() only
  bilinear,  ///< 1 - |x|; radius 1
  bicubic,   ///< cubic convolution, a = -1/2 (Keys 1981, IEEE ASSP-29, 1153); radius 2
  lanczos3,  ///< sinc(x) sinc(x/3); radius 3
  lanczos5   ///< sinc(x) sinc(x/5); radius 5
};

double kernel_radius(Kernel kernel);
/// k(x). `area` has that of a pixel's box, 1 within |x| < 1/2, as `nearest`.
double kernel_value(Kernel kernel, double x);

/// Weights of the whole numbers `first`, `first` + 1... (`count` of them: all within the reach) for
/// a value at x: k((i - x)/scale), changed so that polynomials of a low degree n come out exactly,
/// which plain Lanczos weights do not even do for n = 0: sum w_i (i - x)^m = (m == 0), m <= n, by
/// adding a polynomial of u = (i - x)/(radius scale) times (1 - u^2)^3. Then (Strang & Fix 1971)
/// the kernel's spectrum is flat to that order at the frequencies whose light an interpolated
/// image's sum would take from a smooth image. n = 2 for bicubic (no change where scale is 1), 3
/// for Lanczos kernels.
std::vector<double> interpolation_weights(Kernel kernel, double x, double scale, int first,
                                          int count);

/// "nearest", "area"...; of all kernels, in their order.
const std::vector<std::string>& kernel_names();
/// Throws std::invalid_argument for a name that is none of them.
Kernel kernel_of(std::string_view name);

}  // namespace gamer
