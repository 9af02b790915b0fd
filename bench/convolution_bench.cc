// Time of the convolution of a plane of 4096 x 4096 pixels on one thread, by the side of the PSF,
// in double and single precision. For comparison: the two transforms of the whole plane that FFTW
// alone would need, with estimated and with measured plans.

#include <benchmark/benchmark.h>
#include <fftw3.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/random.h"
#include "image/convolution/convolution.h"
#include "image/convolution/psf.h"

namespace gamer {
namespace {

constexpr int side = 4096;
constexpr std::size_t pixels = std::size_t{side} * side;

PlanePtr make_plane() {
  std::vector<double> values(pixels);
  for (std::size_t i = 0; i < pixels; ++i) values[i] = to_unit(mix64(i));
  return std::make_shared<MemoryPlane>(side, side, std::move(values));
}

void convolve(benchmark::State& state, bool is_single, int stamp_size) {
  static const PlanePtr source = make_plane();
  StampOptions stamp;
  stamp.size = stamp_size;
  ConvolutionOptions options;
  options.is_single = is_single;
  const PlanePtr plane = convolved(source, make_stamp(Psf({PsfKind::moffat, 5}), stamp), options);
  for (auto _ : state) {
    for_each_band(*plane, 1, [](const Area&, const double* values) {
      benchmark::DoNotOptimize(values[0]);
      benchmark::ClobberMemory();
    });
  }
}

void transform(benchmark::State& state, unsigned flags) {
  double* real = fftw_alloc_real(pixels);
  fftw_complex* complex = fftw_alloc_complex(std::size_t{side} * (side / 2 + 1));
  const fftw_plan forward = fftw_plan_dft_r2c_2d(side, side, real, complex, flags);
  const fftw_plan backward = fftw_plan_dft_c2r_2d(side, side, complex, real, flags);
  std::fill_n(real, pixels, 0.0);
  for (auto _ : state) {
    fftw_execute(forward);
    fftw_execute(backward);
    benchmark::ClobberMemory();
  }
  fftw_destroy_plan(forward);
  fftw_destroy_plan(backward);
  fftw_free(complex);
  fftw_free(real);
}

void transform_single(benchmark::State& state, unsigned flags) {
  float* real = fftwf_alloc_real(pixels);
  fftwf_complex* complex = fftwf_alloc_complex(std::size_t{side} * (side / 2 + 1));
  const fftwf_plan forward = fftwf_plan_dft_r2c_2d(side, side, real, complex, flags);
  const fftwf_plan backward = fftwf_plan_dft_c2r_2d(side, side, complex, real, flags);
  std::fill_n(real, pixels, 0.0F);
  for (auto _ : state) {
    fftwf_execute(forward);
    fftwf_execute(backward);
    benchmark::ClobberMemory();
  }
  fftwf_destroy_plan(forward);
  fftwf_destroy_plan(backward);
  fftwf_free(complex);
  fftwf_free(real);
}

void make_psf(benchmark::State& state, const PsfModel& model) {
  StampOptions options;
  options.size = 1001;
  for (auto _ : state) {
    const Stamp stamp = make_stamp(Psf(model), options);
    benchmark::DoNotOptimize(stamp.values[0]);
  }
}

}  // namespace
}  // namespace gamer

int main(int argc, char** argv) {
  using namespace gamer;
  const auto add = [](const std::string& name, auto function, auto... arguments) {
    benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) {
      function(state, arguments...);
    })->Unit(benchmark::kMillisecond);
  };
  for (const int size : {3, 5, 15, 65, 257, 1001}) {
    for (const bool is_single : {false, true}) {
      add("convolve/" + std::to_string(size) + (is_single ? "/single" : "/double"), convolve,
          is_single, size);
    }
  }
  for (const auto& [name, flags] :
       {std::pair{"estimate", FFTW_ESTIMATE}, std::pair{"measure", FFTW_MEASURE}}) {
    add(std::string("two_transforms/") + name + "/double", transform, flags);
    add(std::string("two_transforms/") + name + "/single", transform_single, flags);
  }
  add("psf_1001/gaussian", make_psf, PsfModel{PsfKind::gaussian, 5});
  add("psf_1001/moffat", make_psf, PsfModel{PsfKind::moffat, 5});
  add("psf_1001/airy", make_psf, PsfModel{PsfKind::airy, 5});
  add("psf_1001/airy_obscured_elliptical", make_psf, PsfModel{PsfKind::airy, 5, 3, 0.33, 0.7, 30});
  add("psf_1001/kolmogorov", make_psf, PsfModel{PsfKind::kolmogorov, 5});
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}
