// Adds a kind of component to gamer and renders a galaxy made of it into memory. Prints the ratio
// of its flux to the flux asked for.

#include <gamer/core/error.h>
#include <gamer/job/job.h>
#include <gamer/job/schedule.h>
#include <gamer/parallel/executor.h>
#include <gamer/render/renderer.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "gaussian.h"

int main() {
  gamer::register_component_kind(gaussian_kind());
  std::filesystem::create_directories("galaxies");
  std::ofstream("galaxies/egg.toml")
      << "[[component]]\nclass = \"gaussian\"\nsed = \"E\"\nsigma = 0.15\nq = 0.6\n";
  std::ofstream("egg.par") << "[image]\nsize = 64\n[camera]\nprojection = \"sky\"\n"
                              "center = [10, 20]\npixel_scale = 0.2\n"
                              "[spectrum]\nbands = [\"sdss_r\"]\n";
  std::ofstream("egg.lst") << "galaxy px py redshift size_arcsec apparent_magnitude inclination\n"
                              "egg 32.5 32.5 0.1 5 20 60\n";
  try {
    gamer::JobRequest request;
    request.parameters = "egg.par";
    request.scene = "egg.lst";
    gamer::Resources resources(gamer::default_data_folders());
    const gamer::RenderJob job = gamer::load_job(request, resources);
    const gamer::Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum);
    gamer::ThreadExecutor executor(gamer::available_cores());
    const gamer::Image image = gamer::render_image(renderer, executor);
    double flux = 0;  // nJy
    for (int y = 0; y < image.height(); ++y) {
      for (int x = 0; x < image.width(); ++x) flux += image.at(x, y, 0);
    }
    std::cout << "flux / asked = " << flux / (3631e9 * std::pow(10, -0.4 * 20)) << '\n';
  } catch (const gamer::InputError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
