#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "background.h"
#include "bindings.h"
#include "gamer/core/cancellation.h"
#include "gamer/image/picture.h"
#include "gamer/job/session.h"
#include "gamer/job/stamps.h"

namespace gamer::python {
namespace {

namespace py = pybind11;
namespace fs = std::filesystem;

/// Names, units and values of a table's columns.
using Columns = std::vector<std::tuple<std::string, std::string, py::object>>;

DataTable table_of(const Columns& columns) {
  DataTable table;
  for (const auto& [name, unit, values] : columns) {
    DataColumn column{name, unit, "", {}};
    if (py::isinstance<py::list>(values)) {
      column.values = values.cast<std::vector<std::string>>();
    } else if (values.attr("dtype").attr("kind").cast<std::string>() == "i") {
      column.values = values.cast<std::vector<std::int64_t>>();
    } else {
      column.values = values.cast<std::vector<double>>();
    }
    table.columns.push_back(std::move(column));
  }
  return table;
}

py::array array_of(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

py::list columns_of(const DataTable& table) {
  py::list result;
  for (const DataColumn& column : table.columns) {
    py::object values;
    if (const auto* numbers = std::get_if<std::vector<double>>(&column.values)) {
      values = array_of(*numbers);
    } else if (const auto* wholes = std::get_if<std::vector<std::int64_t>>(&column.values)) {
      values = py::array_t<std::int64_t>(static_cast<py::ssize_t>(wholes->size()), wholes->data());
    } else {
      values = py::cast(std::get<std::vector<std::string>>(column.values));
    }
    result.append(py::make_tuple(column.name, column.unit, column.description, values));
  }
  return result;
}

RenderJob load(const Session& session, const std::string& parameters,
               const std::variant<std::string, fs::path>& scene,
               const std::optional<Columns>& columns,
               const std::map<std::string, std::string>& galaxies,
               const std::vector<std::string>& settings, const std::string& label) {
  RenderInput input{parameters, {}, galaxies, settings, label};
  if (columns) {
    input.scene = table_of(*columns);
  } else if (const auto* text = std::get_if<std::string>(&scene)) {
    input.scene = RenderInput::Text{*text};
  } else {
    input.scene = std::get<fs::path>(scene);
  }
  const py::gil_scoped_release release;
  return session.load(input);
}

RenderJob load_files(const Session& session, const fs::path& parameters, const fs::path& scene,
                     const fs::path& from_header, const std::vector<std::string>& settings) {
  JobRequest request;
  request.parameters = parameters;
  request.scene = scene;
  request.from_header = from_header;
  request.settings = settings;
  const py::gil_scoped_release release;
  return session.load(request);
}

/// The latest progress of a render: the render's thread notes it, and the caller's thread reports
/// it.
class LatestProgress {
 public:
  void note(const RenderProgress& now) {
    const std::lock_guard lock(mutex_);
    now_ = now;
    is_told_ = false;
  }
  void tell(const py::object& progress) {
    if (progress.is_none()) return;
    RenderProgress now;
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(is_told_, true)) return;
      now = now_;
    }
    static constexpr const char* stages[] = {"measuring", "truth", "rows", "stamps"};
    progress(stages[static_cast<int>(now.stage)], now.done, now.total);
  }

 private:
  std::mutex mutex_;
  bool is_told_ = true;
  RenderProgress now_;
};

/// Rank, size, and a function that replaces an array of unsigned integers by its sum over ranks.
using PythonTeam = std::tuple<int, int, py::function>;

Team team_of(const PythonTeam& given) {
  const auto& [rank, size, add_up] = given;
  return {rank, size, [&add_up](std::span<std::byte> integers) {
            const py::gil_scoped_acquire acquire;
            auto* first = reinterpret_cast<std::uint64_t*>(integers.data());
            // An array with a base is a view.
            add_up(py::array_t<std::uint64_t>(integers.size() / sizeof *first, first, py::none()));
          }};
}

/// Called and left with the GIL.
Rendering render_in_background(const Session& session, RenderJob job, bool truth,
                               const py::object& progress, const std::optional<PythonTeam>& team) {
  LatestProgress latest;
  std::optional<Rendering> rendering;
  Background work([&](const Cancellation& cancellation) {
    RenderControl control;
    control.truth = truth;
    control.progress = [&](const RenderProgress& now) { latest.note(now); };
    control.cancellation = &cancellation;
    if (team) control.team = team_of(*team);
    rendering = session.render(std::move(job), control);
  });
  work.finish([&] { latest.tell(progress); });
  latest.tell(progress);
  return std::move(*rendering);
}

/// A finished render with views of its pixels for Python.
class PythonRendering {
 public:
  explicit PythonRendering(Rendering rendering)
      : rendering_(std::move(rendering)), header_(rendering_.header()) {
    is_single_ = rendering_.job->parameters.image.output.bitpix == -32;
  }

  const Rendering& rendering() const { return rendering_; }
  const ImageHeader& header() const { return header_; }

  /// A view of an image's pixels as [plane, y, x] in the precision of the job. `owner` keeps them.
  py::array view(const Image& image, const py::object& owner) {
    const std::vector<py::ssize_t> shape = {image.planes(), image.height(), image.width()};
    if (image.planes() == 0 || image.width() == 0 || image.height() == 0) {
      return is_single_ ? py::array(py::array_t<float>(shape))
                        : py::array(py::array_t<double>(shape));
    }
    if (!is_single_) {
      return py::array_t<double>(shape, image.plane(0), owner);
    }
    std::vector<float>& values = single_[&image];
    if (values.empty()) {
      const std::size_t count = static_cast<std::size_t>(image.planes()) *
                                static_cast<std::size_t>(image.height()) *
                                static_cast<std::size_t>(image.width());
      const double* from = image.plane(0);
      values.assign(from, from + count);
    }
    return py::array_t<float>(shape, values.data(), owner);
  }

 private:
  Rendering rendering_;
  ImageHeader header_;
  bool is_single_ = true;
  std::map<const Image*, std::vector<float>> single_;
};

/// The picture that the program makes, as [y, x, rgb] from the top.
py::array picture_of(const PythonRendering& self) {
  const Image& image = self.rendering().image;
  const ImageHeader& header = self.header();
  const Picture picture = make_picture(image, header.wavelengths, zero_points_of(header));
  return py::array_t<std::uint16_t>({picture.height, picture.width, 3}, picture.rgb.data());
}

void bind_rendering(py::module_& module) {
  py::class_<PythonRendering>(module, "Rendering")
      .def_property_readonly("data",
                             [](py::object self) {
                               auto& own = self.cast<PythonRendering&>();
                               return own.view(own.rendering().image, self);
                             })
      .def_property_readonly("truth_data",
                             [](py::object self) {
                               auto& own = self.cast<PythonRendering&>();
                               return own.view(own.rendering().truth_images, self);
                             })
      .def_property_readonly(
          "stamps",
          [](py::object self) {
            auto& own = self.cast<PythonRendering&>();
            py::list result;
            for (const Rendering::Stamp& stamp : own.rendering().stamps) {
              result.append(py::make_tuple(stamp.region.left, stamp.region.bottom,
                                           own.view(stamp.image, self)));
            }
            return result;
          })
      .def_property_readonly("truth",
                             [](const PythonRendering& self) -> py::object {
                               const auto& truth = self.rendering().truth;
                               return truth ? py::object(columns_of(*truth)) : py::none();
                             })
      .def_property_readonly("stars",
                             [](const PythonRendering& self) -> py::object {
                               const auto& stars = self.rendering().stars;
                               return stars ? py::object(columns_of(*stars)) : py::none();
                             })
      .def_property_readonly("is_stamps",
                             [](const PythonRendering& self) {
                               return makes_stamps(self.rendering().job->parameters);
                             })
      .def_property_readonly("unit", [](const PythonRendering& self) { return self.header().unit; })
      .def_property_readonly("labels",
                             [](const PythonRendering& self) { return self.header().labels; })
      .def_property_readonly("wavelengths",
                             [](const PythonRendering& self) { return self.header().wavelengths; })
      .def_property_readonly("warnings",
                             [](const PythonRendering& self) { return self.rendering().warnings; })
      .def_property_readonly(
          "unconverged_rays",
          [](const PythonRendering& self) { return self.rendering().unconverged_rays; })
      .def_property_readonly(
          "parameters",
          [](const PythonRendering& self) { return self.rendering().job->parameters.toml(); })
      .def("picture", &picture_of)
      .def(
          "write",
          [](const PythonRendering& self, const fs::path& path, bool overwrite) {
            const py::gil_scoped_release release;
            self.rendering().write(path, overwrite);
          },
          py::arg("path"), py::arg("overwrite") = false);
}

}  // namespace

void bind_render(py::module_& module) {
  py::class_<RenderJob>(module, "Job")
      .def_property_readonly("parameters",
                             [](const RenderJob& self) { return self.parameters.toml(); });
  bind_rendering(module);
  py::class_<Session>(module, "Session")
      .def(py::init([](int threads, std::vector<fs::path> folders) {
             return Session(threads > 0 ? threads : available_cores(), std::move(folders));
           }),
           py::arg("threads") = 0, py::arg("folders") = default_data_folders())
      .def("load", &load, py::arg("parameters"), py::arg("scene"), py::arg("columns") = py::none(),
           py::arg("galaxies") = std::map<std::string, std::string>(),
           py::arg("settings") = std::vector<std::string>(), py::arg("label") = "input")
      .def("load_files", &load_files, py::arg("parameters"), py::arg("scene"),
           py::arg("from_header") = fs::path(), py::arg("settings") = std::vector<std::string>())
      .def(
          "render",
          [](const Session& self, RenderJob& job, bool truth, const py::object& progress,
             const std::optional<PythonTeam>& team) {
            if (job.scene == nullptr) throw InputError("a job is rendered once; load it anew");
            return std::make_unique<PythonRendering>(
                render_in_background(self, std::move(job), truth, progress, team));
          },
          py::arg("job"), py::arg("truth") = false, py::arg("progress") = py::none(),
          py::arg("team") = py::none())
      .def_property_readonly("threads", &Session::threads)
      .def_property_readonly("measured",
                             [](const Session& self) { return self.memory().measured(); })
      .def_property_readonly("recalled",
                             [](const Session& self) { return self.memory().recalled(); });
}

}  // namespace gamer::python
