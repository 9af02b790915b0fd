#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "bindings.h"
#include "gamer/core/config.h"
#include "gamer/core/error.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/noise/fractal.h"
#include "gamer/noise/noise.h"

namespace gamer::python {
namespace {

namespace py = pybind11;
using Coordinates = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Number of points over which a noise is normalised.
constexpr std::size_t cloud_batches = 32;

/// Points spread evenly over the cube [-1, 1]^3.
std::vector<WeightedBatch> cube_cloud() {
  std::vector<WeightedBatch> cloud(cloud_batches);
  std::uint64_t next = 0;
  for (WeightedBatch& batch : cloud) {
    batch.size = batch_capacity;
    for (std::size_t i = 0; i < batch.size; ++i) {
      double u[3];
      R3Sequence().point(next++, u);
      batch.x[i] = static_cast<float>(2 * u[0] - 1);
      batch.y[i] = static_cast<float>(2 * u[1] - 1);
      batch.z[i] = static_cast<float>(2 * u[2] - 1);
      batch.weight[i] = 1;
    }
  }
  return cloud;
}

/// A noise whose density has the mean 1 over the cube [-1, 1]^3. `table` is its table `noise` in
/// TOML.
FractalNoise make_noise(const std::string& table, std::uint64_t seed) {
  FractalParameters parameters;
  parameters.kind = &find_noise("simplex");
  parameters.seed = seed;
  const ConfigNode root = parse_toml(table, "noise");
  parameters.apply(ParameterSet::read(parameters.table(), root, "noise: ", "in noise"), "noise: ");
  FractalNoise noise(parameters);
  noise.normalise(cube_cloud());
  return noise;
}

/// Evaluates at points of equal shape; `is_density` chooses Phi, otherwise (S - mu)/sigma.
py::array evaluate(const FractalNoise& noise, const Coordinates& x, const Coordinates& y,
                   const Coordinates& z, bool is_density) {
  const auto count = static_cast<std::size_t>(x.size());
  if (y.size() != x.size() || z.size() != x.size()) {
    throw InputError("x, y and z must have one shape");
  }
  py::array_t<float> result(std::vector<py::ssize_t>(x.shape(), x.shape() + x.ndim()));
  float* const to = result.mutable_data();
  const double *from_x = x.data(), *from_y = y.data(), *from_z = z.data();
  {
    const py::gil_scoped_release release;
    parallel_for((count + batch_capacity - 1) / batch_capacity, [&](std::size_t b) {
      const std::size_t first = b * batch_capacity, size = std::min(batch_capacity, count - first);
      BatchArray at_x{}, at_y{}, at_z{}, out;
      for (std::size_t i = 0; i < size; ++i) {
        at_x[i] = static_cast<float>(from_x[first + i]);
        at_y[i] = static_cast<float>(from_y[first + i]);
        at_z[i] = static_cast<float>(from_z[first + i]);
      }
      const Points points{at_x.data(), at_y.data(), at_z.data(), size};
      is_density ? noise.evaluate(points, out.data()) : noise.sum(points, out.data());
      for (std::size_t i = 0; i < size; ++i) {
        to[first + i] = is_density
                            ? out[i]
                            : static_cast<float>((double{out[i]} - noise.mean()) / noise.sigma());
      }
    });
  }
  return result;
}

}  // namespace

void bind_noise(py::module_& module) {
  py::class_<FractalNoise>(module, "FractalNoise")
      .def(py::init(&make_noise), py::arg("table"), py::arg("seed") = 1)
      .def("evaluate", &evaluate, py::arg("x"), py::arg("y"), py::arg("z"), py::arg("density"))
      .def_property_readonly("mean", &FractalNoise::mean)
      .def_property_readonly("sigma", &FractalNoise::sigma);
  module.def("noise_kinds", [] {
    std::vector<std::pair<std::string, std::string>> result;
    for (const Noise* kind : noise_kinds()) {
      result.emplace_back(std::string(kind->name()), std::string(kind->description()));
    }
    return result;
  });
  module.def("noise_table", [] {
    FractalParameters parameters;
    parameters.kind = &find_noise("simplex");
    return describe(parameters.table());
  });
}

}  // namespace gamer::python
