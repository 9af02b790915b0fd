#pragma once

#include <numeric>
#include <string>
#include <vector>

#include "expectations.h"
#include "gamer/scene/camera.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/scene.h"
#include "named_texts.h"
#include "scene/other_columns.h"

/// Reads a catalogue for a view of the sky, a perspective view and an orthographic view.
class SceneViews {
 public:
  SceneViews() {
    add("[image]\nsize = [40, 30]\n"
        "[camera]\nprojection = \"sky\"\ncenter = [150, 2]\npixel_scale = 0.5\n"
        "[spectrum]\nbands = [\"sdss_r\", \"sdss_g\"]\nigm = \"madau95\"\n"
        "[catalogue]\ngalaxy = \"=ngc4321\"\nsize_arcsec = \"=3\"\n");
    add("[image]\nsize = [40, 30]\n"
        "[camera]\nprojection = \"sky\"\ncenter = [150, 2]\npixel_scale = 0.5\n");
    add("[image]\nsize = [40, 30]\n[scene]\nunit = \"kpc\"\n");
    add("[image]\nsize = [40, 30]\nunit = \"MJy/sr\"\n[scene]\nunit = \"Mpc\"\n"
        "[camera]\nprojection = \"orthographic\"\n");
  }

  void read(const gamer::Catalogue& catalogue) const {
    for (const View& view : views_) {
      expect_errors_only([&] { check(catalogue, view); });
    }
  }

 private:
  struct View {
    gamer::RenderParameters parameters;
    gamer::Camera camera;
    gamer::Spectrum spectrum;
  };

  void add(const char* text) {
    gamer::Resources texts = named_texts();
    gamer::RenderParameters parameters =
        gamer::RenderParameters::read(gamer::parse_toml(text, "render.par"));
    gamer::Camera camera = gamer::make_camera(parameters, texts);
    gamer::Spectrum spectrum = gamer::load_spectrum(parameters, texts);
    views_.push_back({std::move(parameters), std::move(camera), std::move(spectrum)});
  }

  /// The other columns are read back from the record unchanged.
  static void check_others(const gamer::DataTable& others) {
    const std::string text = gamer::ecsv_text(others);
    const auto catalogue = gamer::Catalogue::parse(text, "others", gamer::CatalogueFormat::ecsv);
    std::vector<std::size_t> rows(catalogue.rows());
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    expect(gamer::ecsv_text(gamer::table_of(catalogue, rows)) == text, text.c_str());
  }

  /// The list for other ranks and for the FITS file gives the same scene.
  static void check(const gamer::Catalogue& catalogue, const View& view) {
    gamer::Resources texts = named_texts();
    const gamer::Scene scene =
        gamer::read_scene(catalogue, view.parameters, view.spectrum, view.camera, texts);
    gamer::RenderParameters parameters = view.parameters;
    for (const gamer::Parameter& column : gamer::scene_columns()) {
      parameters.set("catalogue", column.name, std::monostate());
    }
    try {
      const auto list = gamer::Catalogue::parse(scene.list, "list", gamer::CatalogueFormat::list);
      const gamer::Scene again =
          gamer::read_scene(list, parameters, view.spectrum, view.camera, texts);
      check_others(scene.others);
      expect(again.objects == scene.objects && again.list == scene.list, scene.list.str().c_str());
    } catch (const gamer::InputError& error) {
      expect(false, error.what());
    }
  }

  std::vector<View> views_;
};
