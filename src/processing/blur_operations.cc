#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/bound_parameter.h"
#include "image/convolution/convolution.h"
#include "image/convolution/psf.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"
#include "processing/psf_options.h"
#include "processing/varying_convolution.h"

namespace gamer {
namespace {

BoundTable convolution_keys(ConvolutionOptions& p) {
  return {
      choice(p.edge, "edge",
             {{"zero", EdgeMode::zero}, {"reflect", EdgeMode::reflect}, {"wrap", EdgeMode::wrap}},
             "continuation beyond the edges: zeros, the mirrored image, or the repeated image"),
      choice(p.is_single, "precision", {{"double", false}, {"single", true}},
             "floating-point type of the computation")};
}

int run_convolve(const OperationCall& call) {
  const PsfOptions options(call, InstrumentOption(call));
  ConvolutionOptions convolution = read_object(call.parameters, convolution_keys);
  if (!options.is_file()) {
    const StampOptions stamp_options = options.stamp();
    change_planes(call, [&](const PlaneTask& task) {
      const Psf psf = options.psf(task);
      StampOptions sized = stamp_options;
      if (sized.size == 0) sized.size = stamp_size(psf, sized.energy);
      return convolved(
          task.plane, sized.size, sized.size, [psf, sized] { return make_stamp(psf, sized); },
          convolution);
    });
    return 0;
  }
  const std::string& name = call.parameters.text("psf");
  const StampFile file(name, call.parameters.boolean("keep_missing_flux"));
  if (file.varying() && !call.parameters.boolean("one_psf")) {
    change_planes(call, [&](const PlaneTask& task) {
      return convolved(task.plane, file.varying(), convolution);
    });
    return 0;
  }
  change_planes(call, [&](const PlaneTask& task) {
    const PixelPosition middle = {0.5 * (task.plane->width() + 1),
                                  0.5 * (task.plane->height() + 1)};
    const StampSource stamp =
        file.source(options, task.index, task.count, call.inputs.front(), middle);
    return convolved(task.plane, stamp.width, stamp.height, stamp.make, convolution);
  });
  return 0;
}

/// A stamp that is made when it is written.
class StampPlane final : public Plane {
 public:
  StampPlane(Psf psf, const StampOptions& options)
      : Plane(options.size, options.size), psf_(std::move(psf)), options_(options) {}

  Tile tile() const override { return {width(), height()}; }
  using Plane::read;
  void read(const Area& area, double* out, std::ptrdiff_t stride) const override {
    const Stamp stamp = make_stamp(psf_, options_);
    const int half = options_.size / 2;
    for (int y = 0; y < area.height; ++y) {
      for (int x = 0; x < area.width; ++x) {
        out[y * stride + x] = stamp.at(area.x + x - half, area.y + y - half);
      }
    }
  }

 private:
  Psf psf_;
  StampOptions options_;
};

/// Sets a tangential projection with the middle pixel at (0, 0).
void set_scale(FitsHeader& header, double arcsec) {
  constexpr double arcsec_per_degree = 3600;
  header.set("CTYPE1", std::string("RA---TAN"));
  header.set("CTYPE2", std::string("DEC--TAN"));
  header.set("CUNIT1", std::string("deg"));
  header.set("CUNIT2", std::string("deg"));
  header.set("CRVAL1", 0.0);
  header.set("CRVAL2", 0.0);
  header.set("CDELT1", -arcsec / arcsec_per_degree);
  header.set("CDELT2", arcsec / arcsec_per_degree);
}

int run_psf(const OperationCall& call) {
  const PsfOptions options(call);
  const ParameterSet& parameters = call.parameters;
  const bool has_scale = parameters.has("pixel_scale");
  if (options.needs_scale() && !has_scale) {
    options.fail("{} needs --pixel-scale",
                 parameters.has("diameter") ? "--diameter" : "--unit arcsec");
  }
  if (parameters.has("diameter") && !parameters.has("wavelength")) {
    options.fail("--diameter needs --wavelength");
  }
  std::size_t count = 1;
  for (const char* list : {"fwhm", "wavelength"}) {
    if (parameters.has(list)) count = std::max(count, parameters.numbers(list).size());
  }

  FitsHeader header;
  if (has_scale) {
    set_scale(header, parameters.number("pixel_scale"));
    // The scale is measured at this pixel; the middle pixel is known only later.
    header.set("CRPIX1", 1.0);
    header.set("CRPIX2", 1.0);
  }
  std::vector<Psf> psfs;
  std::vector<double> wavelengths;
  StampOptions stamp = options.stamp();
  int size = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string number = count == 1 ? "" : std::to_string(i + 1);
    PlaneTask task{
        nullptr,     {}, header, call.output, static_cast<int>(i), static_cast<int>(count),
        call.threads};
    if (parameters.has("wavelength")) task.info.wavelength = plane_value(call, "wavelength", task);
    psfs.push_back(options.psf(task));
    size = std::max(size, stamp.size == 0 ? stamp_size(psfs.back(), stamp.energy) : stamp.size);
    if (task.info.wavelength) wavelengths.push_back(*task.info.wavelength);
    header.set({"FWHM" + number, psfs.back().model().fwhm, "[pixel] full width at half maximum"});
  }
  stamp.size = size;
  header.set({"PSF", parameters.text("psf"), "model of the point-spread function"});
  if (has_scale) {
    const double middle = size / 2 + 1;
    header.set("CRPIX1", middle);
    header.set("CRPIX2", middle);
  }
  header.set({"HISTORY", {}, call.history});
  std::vector<PlanePtr> planes;
  for (const Psf& psf : psfs) planes.push_back(std::make_shared<StampPlane>(psf, stamp));
  FitsOutput output({call.output, call.overwrite});
  constexpr int double_bitpix = -64;
  output.write_cube(header, planes, wavelengths, call.bitpix == 0 ? double_bitpix : call.bitpix,
                    call.threads);
  output.finish();
  return 0;
}

Operation convolve_operation() {
  return {.name = "convolve",
          .summary = "Convolve with a point-spread function",
          .description =
              std::string("out(x, y) = sum over (i, j) of psf(i, j) in(x - i, y - j). ") +
              psf_model_text +
              "The PSF's sum is 1, so that flux is kept, except for light that leaves the image "
              "with --edge zero.\n\nAny other text of --psf names a FITS file (extended names "
              "too), or a .psf file of PSFEx. The FITS image has odd sides and is centred on its "
              "middle pixel, with one plane, or one for each plane of the input. The PSF of PSFEx "
              "varies over the image: the light of each pixel gets the PSF at that pixel. "
              "--one-psf takes the PSF of the image's middle everywhere.\n\n--position-angle is "
              "measured on the sky from North towards East, at the middle of the image. Without "
              "celestial coordinates the angle runs from +y towards -x.\n\nMissing pixels (NaN or "
              "infinite) are NaN in the output and spread no further. Where the PSF covers missing "
              "pixels, the weights of the others are scaled up to replace them. rotate, resample "
              "and bin differ: there infinities spread. Single precision is quicker, and accurate "
              "to about 1e-7 of the brightest pixel nearby. The header gains one HISTORY card.",
          .parameters =
              ParameterTable{
                  Parameter::text("psf", std::nullopt,
                                  fmt::format("{}, or a FITS file", fmt::join(psf_models(), ", "))),
                  InstrumentOption::parameter()} +
              psf_parameters({"unit of --fwhm; arcsec needs celestial coordinates",
                              "direction of the major axis, from North towards East; without "
                              "celestial coordinates from +y towards -x"}) +
              ParameterTable{Parameter::boolean(
                  "one_psf", false,
                  "for a .psf file of PSFEx: use its PSF at the middle of the image everywhere")} +
              declarations(convolution_keys),
          .example = "convolve --psf moffat --fwhm 3.5 --beta 3 in.fits out.fits",
          .run = run_convolve};
}

Operation psf_operation() {
  return {
      .name = "psf",
      .summary = "Write the image of a point-spread function",
      .description =
          std::string(psf_model_text) +
          "The image has odd sides, the PSF's centre on the middle pixel, and the sum 1. Several "
          "widths or wavelengths make a cube. Its third axis is the wavelength where wavelengths "
          "are evenly spaced, otherwise the number of the plane. The header holds FWHM in pixels "
          "(FWHMn for plane n), and WAVELENn where --wavelength is given. With --pixel-scale the "
          "header has celestial coordinates of that scale, North up and East to the left.",
      .least_inputs = 0,
      .most_inputs = 0,
      .parameters =
          ParameterTable{required(Parameter::choice("psf", psf_models(), std::nullopt, "model"))} +
          psf_parameters({"unit of --fwhm; arcsec needs --pixel-scale",
                          "direction of the major axis, from +y towards -x: from North towards "
                          "East with --pixel-scale"}) +
          ParameterTable{
              Parameter::number("pixel_scale", "arcsec", Interval::left_open(0, 3600), std::nullopt,
                                "side of a pixel"),
              Parameter::numbers("wavelength", "Angstrom", Interval::positive(), std::nullopt,
                                 "wavelength for --diameter; one value, or one for each plane")},
      .example = "psf --psf airy --fwhm 3 --obscuration 0.33 --size 65 out.fits",
      .run = run_psf};
}

}  // namespace

std::vector<Operation> blur_operations() { return {convolve_operation(), psf_operation()}; }

}  // namespace gamer
