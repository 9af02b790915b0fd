#include <cstdint>
#include <string>
#include <vector>

#include "gamer/core/parallel_for.h"
#include "processing/galaxy_options.h"
#include "processing/measurement_table.h"
#include "processing/morphology.h"
#include "processing/morphology_picture.h"
#include "processing/operation_groups.h"

namespace gamer {
namespace {

void put_morphology(DataTable& table, const PlaneTask& task, const GalaxyPlane& galaxy,
                    const Morphology& found) {
  put_plane(table, task);
  put(table, "concentration", found.concentration, "", "C = 5 log10(r80/r20)");
  put(table, "asymmetry", found.asymmetry, "", "A, less the noise's part");
  put(table, "smoothness", found.smoothness, "", "S of Conselice, with the factor 10");
  put(table, "smoothness_lotz", found.smoothness_lotz, "", "S of Lotz, without that factor");
  put(table, "gini", found.gini);
  put(table, "m20", found.m20);
  put(table, "bulge_statistic", found.bulge_statistic(), "", "F(G, M20)");
  put(table, "merger_statistic", found.merger_statistic(), "", "G + 0.14 M20 - 0.33");
  put<std::string>(table, "lotz_class", found.lotz_class(), "", "merger, E-Sa or Sb-Irr");
  put(table, "multimode", found.mid.multimode, "", "M");
  put(table, "intensity", found.mid.intensity, "", "I");
  put(table, "deviation", found.mid.deviation, "", "D");
  put_centre(table, galaxy, found.x, found.y);
  put(table, "petrosian", found.petrosian, "pixel", "Petrosian radius of circles");
  put(table, "petrosian_major", found.petrosian_major, "pixel", "of ellipses, semi-major axis");
  put(table, "axis_ratio", found.axis_ratio, "", "of the light's moments");
  put(table, "position_angle", position_angle_of(galaxy, found.x, found.y, found.angle), "deg",
      "of the light's moments, on the sky if known");
  put(table, "r20", found.r20, "pixel", "holds 20 % of the flux");
  put(table, "r50", found.r50, "pixel");
  put(table, "r80", found.r80, "pixel");
  put(table, "flux", found.flux, "", "within 1.5 Petrosian radii, sum of the pixels");
  put(table, "asymmetry_sky", found.asymmetry_sky, "", "the noise's part of A, subtracted");
  put(table, "sky", galaxy.sky, "", "subtracted from each pixel");
  put(table, "sky_sigma", found.sky_sigma);
  put_count(table, "pixels", static_cast<std::int64_t>(found.pixels), "", "of Gini and M20");
}

int run_morphology(const OperationCall& call) {
  check_table(call);
  check_output(call, "plot", {".png"});
  use_threads(call.threads);
  const FitsInput input(call.inputs.front());
  const std::vector<PlaneTask> tasks = chosen_planes(call, input);
  if (call.parameters.has("plot") && tasks.size() != 1) {
    throw wrong(call, "--plot shows one plane, not {}; choose it with --planes", tasks.size());
  }
  DataTable table;
  table.name = "morphology";
  for (const PlaneTask& task : tasks) {
    const GalaxyPlane galaxy = galaxy_plane(call, task);
    MorphologyOptions options;
    options.threads = call.threads;
    if (galaxy.start) {
      options.x = galaxy.start->x;
      options.y = galaxy.start->y;
    }
    if (call.parameters.has("sky_sigma")) options.sky_sigma = call.parameters.number("sky_sigma");
    try {
      const Morphology found = morphology(galaxy.image, options);
      put_morphology(table, task, galaxy, found);
      if (call.parameters.has("plot")) {
        write_morphology_picture(call.parameters.text("plot"), galaxy.image, found, call.overwrite);
      }
    } catch (const InputError& error) {
      throw wrong(call, "{}: {}", plane_label(task), error.what());
    }
  }
  deliver(call, {table}, table);
  return 0;
}

}  // namespace

Operation morphology_operation() {
  return {
      .name = "morphology",
      .summary =
          "Concentration, asymmetry, smoothness, Gini, M20 and the multimode statistics of a "
          "galaxy",
      .description =
          "Each plane has a row; docs/morphology.md defines each number. The Petrosian radius Rp "
          "is where I(r)/<I>(<r) = 0.2. The flux is that within 1.5 Rp. C = 5 log10(r80/r20). A = "
          "(min sum|I - I180| - noise)/sum|I|. The centre of least A, found to 1/64 pixel, is the "
          "centre of all circles. S = 10 (sum max(0, I - Is) - noise)/sum I, with a box of 0.3 Rp "
          "and without the innermost 0.075 Rp; smoothness_lotz has no factor 10, a box of 0.25 Rp, "
          "and radii from 0.25 Rp. Gini and M20 are of the pixels above the mean on the Petrosian "
          "ellipse, after a Gaussian of sigma Rp/5. bulge_statistic = -0.693 M20 + 4.95 G - 3.96. "
          "The noise in A and S is measured in the image's corners. With --sky-sigma it is white "
          "noise of this deviation (0: none). Pixels must hold light in linear units; rendered "
          "images have no sky. At least 300 pixels across 2 Rp make numbers comparable with "
          "published ones. A galaxy whose circle of 1.5 Rp leaves the image is refused. A plane is "
          "held in memory, about 60 bytes per pixel.",
      .result = Operation::Result::text,
      .parameters = with_output(
          galaxy_parameters() +
          ParameterTable{
              Parameter::number("sky_sigma", "unit of the pixels", Interval::at_least(0),
                                std::nullopt,
                                "noise of a pixel (default: measured in the corners)"),
              Parameter::text("plot", std::nullopt,
                              "draw the plane with its apertures and segmentation: .png"),
          }),
      .example = "morphology --planes 2 --plot apertures.png in.fits",
      .run = run_morphology};
}

}  // namespace gamer
