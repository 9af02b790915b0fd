// Fuzzes parameter files with any text, followed by words for --set, each after a NUL.

#include <cstdint>
#include <string>
#include <string_view>

#include "expectations.h"
#include "gamer/scene/animation.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/render_parameters.h"
#include "gamer/scene/spectrum.h"
#include "named_texts.h"

namespace {

/// Parameters that are written into a FITS file are read back unchanged.
void check_record(const gamer::RenderParameters& parameters) {
  const std::string text = parameters.toml();
  try {
    expect(gamer::RenderParameters::read(gamer::parse_toml(text, "")).toml() == text, text.c_str());
  } catch (const gamer::InputError& error) {
    expect(false, error.what());
  }
}

/// An accepted path has views at its first, middle and last frame.
void check_frames(const gamer::RenderParameters& parameters) {
  const gamer::CameraPath path(parameters);
  for (const int frame : {0, path.frames() / 2, path.frames() - 1}) {
    try {
      check_record(gamer::frame_parameters(parameters, path, frame));
    } catch (const gamer::InputError& error) {
      expect(false, error.what());
    }
  }
}

void read(std::string_view text) {
  std::size_t end = text.find('\0');
  gamer::ConfigNode root = gamer::parse_toml(text.substr(0, end), "render.par");
  while (end != std::string_view::npos) {
    text.remove_prefix(end + 1);
    end = text.find('\0');
    gamer::set_from_text(root, text.substr(0, end));
  }
  gamer::RenderParameters parameters = gamer::RenderParameters::read(root);
  check_record(parameters);
  if (parameters.animation.frames > 0) check_frames(parameters);
  gamer::Resources texts = named_texts();
  gamer::load_spectrum(parameters, texts);
  const gamer::Camera camera = gamer::make_camera(parameters, texts);
  camera.ray(0, 0);
  camera.solid_angle(0, camera.height() - 1);
  check_record(parameters);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  expect_errors_only([&] { read({reinterpret_cast<const char*>(data), size}); });
  return 0;
}
