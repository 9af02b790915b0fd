#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gamer {

/// Kernels k(x) for interpolation between pixels; x in pixels, k(x) = 0 beyond the radius.
enum class Kernel {
  nearest,   ///< the nearest pixel; radius 1/2
  area,      ///< exact overlap of pixels; resample() only
  bilinear,  ///< 1 - |x|; radius 1
  bicubic,   ///< cubic convolution, a = -1/2 (Keys 1981, IEEE ASSP-29, 1153); radius 2
  lanczos3,  ///< sinc(x) sinc(x/3); radius 3
  lanczos5   ///< sinc(x) sinc(x/5); radius 5
};

double kernel_radius(Kernel kernel);
/// k(x). For `area` it is a pixel's box, 1 within |x| < 1/2, as for `nearest`.
double kernel_value(Kernel kernel, double x);

/// Weights of the `count` whole numbers from `first` on (all within the reach) for a value at x:
/// k((i - x)/scale) with a correction. Polynomials up to the degree n are reproduced exactly:
///   sum w_i (i - x)^m = (m == 0), m <= n.
/// Plain Lanczos weights fail even for n = 0. The correction is a polynomial of u = (i - x)/(radius
/// scale) times (1 - u^2)^3. By Strang & Fix 1971 the kernel's spectrum is then flat to that order
/// at the frequencies that would change the flux of a smooth image. The degree n is 2 for bicubic
/// (unchanged at scale 1) and 3 for Lanczos kernels.
std::vector<double> interpolation_weights(Kernel kernel, double x, double scale, int first,
                                          int count);

/// The names of all kernels, in their order: "nearest", "area"...
const std::vector<std::string>& kernel_names();
/// The kernel of this name. Throws std::invalid_argument for an unknown name.
Kernel kernel_of(std::string_view name);

}  // namespace gamer
