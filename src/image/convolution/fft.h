#pragma once

#include <fftw3.h>

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include "image/convolution/fftw_planner.h"

namespace gamer {

/// FFTW in one precision.
template <class Real>
struct Fftw;

template <>
struct Fftw<double> {
  using Plan = fftw_plan;
  using Complex = fftw_complex;
  static constexpr auto allocate = fftw_malloc;
  static constexpr auto release = fftw_free;
  static constexpr auto plan_forward = fftw_plan_dft_r2c_2d;
  static constexpr auto plan_backward = fftw_plan_dft_c2r_2d;
  static constexpr auto forward = fftw_execute_dft_r2c;
  static constexpr auto backward = fftw_execute_dft_c2r;
  static constexpr auto destroy = fftw_destroy_plan;
};

template <>
struct Fftw<float> {
  using Plan = fftwf_plan;
  using Complex = fftwf_complex;
  static constexpr auto allocate = fftwf_malloc;
  static constexpr auto release = fftwf_free;
  static constexpr auto plan_forward = fftwf_plan_dft_r2c_2d;
  static constexpr auto plan_backward = fftwf_plan_dft_c2r_2d;
  static constexpr auto forward = fftwf_execute_dft_r2c;
  static constexpr auto backward = fftwf_execute_dft_c2r;
  static constexpr auto destroy = fftwf_destroy_plan;
};

/// An array of reals, aligned for FFTW's full speed.
template <class Real>
class Buffer {
 public:
  explicit Buffer(std::size_t size)
      : values_(static_cast<Real*>(Fftw<Real>::allocate(size * sizeof(Real)))) {
    if (!values_) throw std::bad_alloc();
  }
  Real* get() const { return values_.get(); }

 private:
  struct Release {
    void operator()(Real* values) const { Fftw<Real>::release(values); }
  };
  std::unique_ptr<Real, Release> values_;
};

/// In-place transforms of one size: rows of 2 (width/2 + 1) reals.
template <class Real>
class Transform {
 public:
  Transform(int width, int height) : width_(width), height_(height) {
    using Api = Fftw<Real>;
    const Buffer<Real> buffer(reals());
    Real* const real = buffer.get();
    const std::lock_guard lock(fftw_planner_mutex());
    // FFTW_ESTIMATE, since plans chosen by timing would round differently from run to run.
    forward_ = Api::plan_forward(height, width, real, complex(real), FFTW_ESTIMATE);
    backward_ = Api::plan_backward(height, width, complex(real), real, FFTW_ESTIMATE);
    if (forward_ == nullptr || backward_ == nullptr) throw std::bad_alloc();
  }
  ~Transform() {
    const std::lock_guard lock(fftw_planner_mutex());
    Fftw<Real>::destroy(forward_);
    Fftw<Real>::destroy(backward_);
  }
  Transform& operator=(Transform&&) = delete;

  int width() const { return width_; }
  int height() const { return height_; }
  std::ptrdiff_t stride() const { return 2 * (width_ / 2 + 1); }
  std::size_t reals() const {
    return static_cast<std::size_t>(stride()) * static_cast<std::size_t>(height_);
  }

  /// Memory for reals() values: returned memory, or new.
  Buffer<Real> take_buffer() const {
    const std::lock_guard lock(mutex_);
    if (buffers_.empty()) return Buffer<Real>(reals());
    Buffer<Real> buffer = std::move(buffers_.back());
    buffers_.pop_back();
    return buffer;
  }
  void give_back(Buffer<Real> buffer) const {
    const std::lock_guard lock(mutex_);
    buffers_.push_back(std::move(buffer));
  }

  void forward(Real* values) const { Fftw<Real>::forward(forward_, values, complex(values)); }
  void backward(Real* values) const { Fftw<Real>::backward(backward_, complex(values), values); }

 private:
  static typename Fftw<Real>::Complex* complex(Real* values) {
    return reinterpret_cast<typename Fftw<Real>::Complex*>(values);
  }

  int width_, height_;
  typename Fftw<Real>::Plan forward_ = nullptr, backward_ = nullptr;
  mutable std::mutex mutex_;
  mutable std::vector<Buffer<Real>> buffers_;
};

/// The transforms of a size, made once.
template <class Real>
const Transform<Real>& transform_of(int width, int height) {
  static std::mutex mutex;
  static std::map<std::pair<int, int>, std::unique_ptr<Transform<Real>>> all;
  const std::lock_guard lock(mutex);
  auto& transform = all[{width, height}];
  if (!transform) transform = std::make_unique<Transform<Real>>(width, height);
  return *transform;
}

}  // namespace gamer
