#pragma once

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace gamer {

/// While an instance lives, this thread treats denormal numbers (single precision: below 1.2e-38)
/// as zero, in operands and results. Densities far from a galaxy's centre are that low, and each
/// product of them costs x86 cores a hundred cycles more. On other machines the class does nothing.
/// Statistics of galaxies do not need it, since their points lie where there is light.
class DenormalsAreZero {
 public:
#if defined(__SSE__)
  DenormalsAreZero() : before_(_mm_getcsr()) { _mm_setcsr(before_ | are_zero | flush_to_zero); }
  ~DenormalsAreZero() { _mm_setcsr(before_); }
#else
  // User-provided, so that compilers do not warn of an unused variable.
  DenormalsAreZero() {}
#endif
  DenormalsAreZero& operator=(DenormalsAreZero&&) = delete;

 private:
#if defined(__SSE__)
  static constexpr unsigned are_zero = 0x0040, flush_to_zero = 0x8000;
  unsigned before_;
#endif
};

}  // namespace gamer
