#pragma once

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace gamer {

/// While one lives, this thread takes denormal numbers (single precision: below 1.2e-38) for zero,
/// given or computed: densities far from a galaxy's centre fall that low, where x86 cores need a
/// hundred cycles more for each product. On other machines it does nothing. Statistics of galaxies
/// do without: their points lie where there is light.
class DenormalsAreZero {
 public:
#if defined(__SSE__)
  DenormalsAreZero() : before_(_mm_getcsr()) { _mm_setcsr(before_ | are_zero | flush_to_zero); }
  ~DenormalsAreZero() { _mm_setcsr(before_); }
#else
  // Not trivial, so that no compiler calls it unused.
  DenormalsAreZero() {}
#endif
  DenormalsAreZero(const DenormalsAreZero&) = delete;
  DenormalsAreZero& operator=(const DenormalsAreZero&) = delete;

 private:
#if defined(__SSE__)
  static constexpr unsigned are_zero = 0x0040, flush_to_zero = 0x8000;
  unsigned before_;
#endif
};

}  // namespace gamer
