// Renders a galaxy at several inclinations and depths of dust. A session keeps the galaxy's
// measurements, so that only the first render takes long. Another thread may cancel a render.
//
//   parameter_sweep galaxy [dust component]

#include <gamer/gamer.h>

#include <iostream>
#include <numeric>
#include <string>
#include <thread>

namespace {

constexpr const char* view = R"(
[image]
size = 48
[camera]
projection = "orthographic"
position = [0, 0, 10]
up = [0, 1, 0]
width = 2.4
[spectrum]
wavelengths = [4400, 5500]
[sampling]
tolerance = 2e-2
)";

gamer::RenderInput input(const std::string& galaxy, int inclination) {
  gamer::RenderInput result;
  result.parameters = view;
  result.scene = gamer::RenderInput::Text{"galaxy x y z inclination pa\n" + galaxy + " 0 0 0 " +
                                          std::to_string(inclination) + " 30\n"};
  return result;
}

double light(const gamer::Image& image, int plane) {
  const double* begin = image.plane(plane);
  return std::accumulate(begin, begin + image.width() * image.height(), 0.0);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: parameter_sweep galaxy [dust component]\n";
    return 2;
  }
  const std::string galaxy = argv[1];
  try {
    const gamer::Session session;
    for (const int inclination : {0, 40, 80}) {
      for (const int depth : {0, 1, 2}) {
        gamer::RenderInput own = input(galaxy, inclination);
        if (argc > 2) {
          own.settings = {"galaxy." + galaxy + "." + argv[2] +
                          ".optical_depth=" + std::to_string(depth)};
        }
        const gamer::Rendering rendering = session.render(session.load(own));
        std::cout << "inclination " << inclination << ", depth " << depth << ": blue/visual "
                  << light(rendering.image, 0) / light(rendering.image, 1) << '\n';
        if (argc == 2) break;
      }
    }
    std::cout << session.memory().measured() << " parts measured, " << session.memory().recalled()
              << " recalled\n";

    gamer::Cancellation cancellation;
    gamer::RenderControl control;
    control.cancellation = &cancellation;
    std::thread user([&] { cancellation.request(); });
    try {
      session.render(session.load(input(galaxy, 60)), control);
      std::cout << "done before it was cancelled\n";
    } catch (const gamer::Cancelled&) {
      std::cout << "cancelled\n";
    }
    user.join();
  } catch (const gamer::InputError& error) {
    std::cerr << error.what() << '\n';
    return 2;
  }
}
