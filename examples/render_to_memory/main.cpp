// Renders a galaxy into memory with gamer as a library, and prints the total of each plane.
//
//   render_to_memory render.par scene.lst

#include <gamer/core/error.h>
#include <gamer/job/job.h>
#include <gamer/job/schedule.h>
#include <gamer/parallel/executor.h>
#include <gamer/render/renderer.h>

#include <iostream>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: render_to_memory render.par scene.lst\n";
    return 2;
  }
  try {
    gamer::JobRequest request;
    request.parameters = argv[1];
    request.scene = argv[2];
    request.settings = {"image.size=64", "sampling.tolerance=1e-2"};
    gamer::Resources resources(gamer::default_data_folders());
    const gamer::RenderJob job = gamer::load_job(request, resources);

    const gamer::Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum);
    gamer::ThreadExecutor executor(gamer::available_cores());
    const gamer::Image image = gamer::render_image(renderer, executor);

    for (int plane = 0; plane < image.planes(); ++plane) {
      double sum = 0;
      for (int y = 0; y < image.height(); ++y) {
        for (int x = 0; x < image.width(); ++x) sum += image.at(x, y, plane);
      }
      std::cout << job.spectrum.planes[static_cast<std::size_t>(plane)].label << ": total " << sum
                << '\n';
    }
  } catch (const gamer::InputError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
