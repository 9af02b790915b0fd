#include <algorithm>
#include <variant>
#include <vector>

#include "core/message.h"
#include "gamer/core/near.h"
#include "gamer/image/instrument.h"
#include "gamer/job/job.h"
#include "job/scene_input.h"

namespace gamer {

// The parameters of a request: its file with the request's changes.

namespace {

/// Replaces the region by the smallest one of a preview's pixels that holds it.
void reduce_region(RenderParameters& parameters) {
  if (!parameters.image.region) return;
  const ImageRegion& region = *parameters.image.region;
  const auto below = [](int place) { return place / preview_reduction; };
  const auto above = [](int place) { return (place + preview_reduction - 1) / preview_reduction; };
  const int left = below(region.left), bottom = below(region.bottom);
  parameters.set("image", "region",
                 std::vector<double>{left + 1.0, bottom + 1.0, double(above(region.right()) - left),
                                     double(above(region.top()) - bottom)});
}

}  // namespace

void make_preview(RenderParameters& parameters) {
  const auto reduced = [](int size) {
    return static_cast<double>((size + preview_reduction - 1) / preview_reduction);
  };
  // The WCS of a FITS header cannot be reduced to a quarter of the size.
  if (parameters.camera.header.empty()) {
    const double width = reduced(parameters.width);
    if (parameters.camera.projection == Projection::sky) {
      parameters.set("camera", "pixel_scale",
                     parameters.camera.sky.pixel_scale * parameters.width / width);
    }
    if (parameters.camera.projection == Projection::healpix) {
      parameters.set("camera", "nside", static_cast<std::int64_t>(width));
    } else {
      const bool is_cube = parameters.camera.projection == Projection::cubemap;
      const double height = is_cube ? width : reduced(parameters.height);
      parameters.set("image", "size", std::vector<double>{width, height});
      reduce_region(parameters);
    }
  }
  parameters.set("camera", "supersample", std::int64_t{1});
  parameters.set("sampling", "tolerance",
                 std::max(parameters.sampling.tolerance, preview_tolerance));
}

namespace {

/// Whether a file is read as a parameter file.
bool holds_parameters(const std::filesystem::path& path) {
  try {
    Resources files(std::vector<std::filesystem::path>{});
    return !parse_toml(files.read("", path).content, "").table().empty();
  } catch (const InputError&) {
    return false;
  }
}

ConfigNode read_parameter_file(const JobRequest& request, Resources& resources) {
  try {
    const Resources::Text& text =
        read_named_file(resources, recorded_parameters, source_of(request, request.parameters));
    return parse_toml(text.content, text.label);
  } catch (const InputError& error) {
    if (request.from_header.empty() && holds_parameters(request.scene)) {
      throw input_error("{}; the parameter file stands before the scene: gamer {} {}", error.what(),
                        request.scene.generic_string(), request.parameters.generic_string());
    }
    throw;
  }
}

void set_output(const std::filesystem::path& path, RenderParameters& parameters) {
  parameters.set("image", "output", path.string());
  try {
    // The record holds TOML, which is UTF-8.
    parse_toml(parameters.toml(), "");
  } catch (const InputError&) {
    throw InputError({"--output", 0, 0}, "the name of the file is not valid UTF-8");
  }
}

/// Throws InputError, without a place, for a band that `gutil noise` and `gutil convolve` would not
/// find in the instrument.
void check_bands(const Instrument& instrument, const std::vector<std::string>& bands) {
  for (const std::string& band : bands) {
    try {
      instrument.band(std::filesystem::path(band).stem().string());
    } catch (const InputError& error) {
      throw input_error("{}; camera.pixel_scale instead goes with any band", error.what());
    }
  }
}

/// Gives the pixels of an instrument to a camera whose pixel_scale is not given.
void take_instrument(const std::string& label, Resources& resources, RenderParameters& parameters) {
  const ParameterSet& camera = parameters.section("camera");
  if (!camera.has("instrument") || camera.is_given("pixel_scale")) return;
  try {
    const Instrument found = find_instrument(camera.text("instrument"), label, resources);
    check_bands(found, parameters.spectrum.bands);
    parameters.set("camera", "pixel_scale", found.pixel_scale);
  } catch (const InputError& error) {
    throw InputError(camera.where("instrument"), error.what());
  }
}

/// Sets image.layout. Throws InputError where the file or the command line sets another one.
void set_stamps(ConfigNode& root) {
  const ConfigNode* image = root.find("image");
  const ConfigNode* layout = image != nullptr ? image->find("layout") : nullptr;
  if (layout != nullptr && std::holds_alternative<std::string>(layout->data) &&
      std::get<std::string>(layout->data) != "cube" &&
      std::get<std::string>(layout->data) != "stamps") {
    throw input_error(layout->where, "layout = \"{}\" is not that of --stamps; leave it out",
                      std::get<std::string>(layout->data));
  }
  set_from_text(root, "image.layout=\"stamps\"", "--stamps sets ");
}

/// Throws InputError where an image of a region of the sky is made again with another region, for
/// which the record may lack objects.
void check_recorded_region(const JobRequest& request, const ConfigNode& recorded,
                           const RenderParameters& parameters) {
  // The records of other views hold all objects.
  if (parameters.camera.projection != Projection::sky) return;
  if (request.from_header.empty() || recorded.find("image") == nullptr ||
      recorded.find("image")->find("region") == nullptr) {
    return;
  }
  const ParameterSet& image = parameters.section("image");
  const RenderParameters before = RenderParameters::read(recorded);
  if (image.numbers("region") == before.section("image").numbers("region")) return;
  throw input_error(image.where("region"),
                    "{} is itself a region, {}, and holds no other objects; begin with the whole "
                    "image or with the catalogue",
                    in_quotes(request.from_header.generic_string()),
                    value_text(before.section("image").value("region")));
}

}  // namespace

RenderParameters load_parameters(const JobRequest& request, Resources& resources) {
  ConfigNode root = read_parameter_file(request, resources);
  const ConfigNode recorded = root;
  for (const std::string& setting : request.settings) set_from_text(root, setting);
  if (!request.region.empty()) {
    set_from_text(root, fmt::format("image.region=[{}]", fmt::join(request.region, ", ")),
                  "--region sets ");
  }
  if (request.stamps) set_stamps(root);
  RenderParameters parameters = RenderParameters::read(root);
  take_instrument(root.where.file, resources, parameters);
  check_recorded_region(request, recorded, parameters);
  if (request.output) set_output(*request.output, parameters);
  if (request.preview) make_preview(parameters);
  parameters.image.output.overwrite = request.overwrite;
  return parameters;
}

}  // namespace gamer
