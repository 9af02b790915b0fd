#include "gamer/scene/render_parameters.h"

#include <gtest/gtest.h>

#include "scene/scene_checks.h"

namespace gamer::render_parameters_test {
namespace {

using test::message_of;
using test::parameters_of;

TEST(RenderParameters, DefaultsAreThoseOfTheFormats) {
  const RenderParameters p;
  EXPECT_EQ(p.width, 512);
  EXPECT_EQ(p.height, 512);
  EXPECT_EQ(p.image.output.path, "gamer.fits");
  EXPECT_EQ(p.image.output.bitpix, -32);
  EXPECT_EQ(p.image.output.layout, ImageLayout::cube);
  EXPECT_FALSE(p.image.output.overwrite);
  EXPECT_EQ(p.camera.projection, Projection::perspective);
  EXPECT_EQ(p.camera.position, glm::dvec3(0, -3, 0));
  EXPECT_EQ(p.camera.target, glm::dvec3(0, 0, 0));
  EXPECT_EQ(p.camera.up, glm::dvec3(0, 0, 1));
  EXPECT_EQ(p.camera.fov, 45);
  EXPECT_EQ(p.camera.width, 2.5);
  EXPECT_EQ(p.camera.supersample, std::nullopt);
  EXPECT_EQ(p.spectrum.wavelengths, std::vector<double>{5500});
  ASSERT_NE(p.noise.kind, nullptr);
  EXPECT_EQ(p.noise.kind->name(), "simplex");
  EXPECT_EQ(p.noise.octaves, std::nullopt);
  EXPECT_EQ(p.noise.seed, 1u);
  EXPECT_EQ(p.sampling.sampler, SamplerKind::adaptive);
  EXPECT_EQ(p.sampling.step, 0.01);
  EXPECT_EQ(p.sampling.tolerance, 1e-3);
  EXPECT_EQ(p.scene.unit, "");
  EXPECT_EQ(p.megaparsec(), std::nullopt);
  EXPECT_EQ(p.image.unit, std::nullopt);
  EXPECT_TRUE(p.spectrum.bands.empty());
  EXPECT_EQ(p.spectrum.band_samples, std::nullopt);
  EXPECT_EQ(p.spectrum.igm, Igm::none);
  EXPECT_EQ(p.photometry.reference_band, "sdss_r");
  EXPECT_FALSE(p.photometry.attenuated);
  EXPECT_EQ(p.photometry.throughput, 1);
  EXPECT_EQ(p.cosmology.h0(), 70);
  EXPECT_EQ(p.cosmology.omega_m(), 0.3);
  EXPECT_EQ(p.catalogue.format, CatalogueFormat::automatic);
  EXPECT_TRUE(p.catalogue.columns.empty());
  EXPECT_FALSE(p.truth.any());
}

TEST(RenderParameters, AnEmptyFileGivesTheDefaults) {
  EXPECT_EQ(parameters_of("").toml(), RenderParameters().toml());
}

const char* const other_values = R"([image]
size = [640, 480]
output = "a \"b\".fits.fz"
bitpix = -64
layout = "files"
unit = "MJy/sr"
brightness = 1.5
contrast = 2.5
saturation = 2
seeing = 1.7
sky = 0.05
grain = 0.01
grain_seed = 3

[camera]
projection = "orthographic"
position = [1.5, -2, 3]
target = [0.1, 0, 0]
up = [0, 1, 0]
width = 1e-07
shear = [0.01, -0.02]
supersample = 4

[spectrum]
wavelengths = [4400, 5500.25, 8140]
bands = ["sdss_g", "my.band"]
band_samples = 3
igm = "madau95"

[photometry]
reference_band = "bessell_v"
attenuated = true
area = 4.5
throughput = 0.6

[cosmology]
H0 = 67.7
Omega_m = 0.31

[noise]
kind = "perlin"
octaves = 5
seed = 9223372036854775807

[sampling]
sampler = "uniform"
step = 0.005
tolerance = 0.01
stars_per_pixel = 2

[stars]
antialiased = false
white_point = 12.5
largest_radius = 3
halo = 0.25
spikes = 0.125
table = true

[scene]
unit = "kpc"
overrides = ["spiral.disk.strength=2"]
solo = "disk"

[catalogue]
format = "sextractor"
hdu = "OBJECTS"
skip_flagged = true
x = "X_WORLD"
seed = "=7"

[truth]
parts = "components"
dust_free = true
optical_depth = true
segmentation = true
output = "t.fits"
)";

const char* const sky_values = R"([camera]
projection = "sky"
center = [150.25, -2.5]
pixel_scale = 0.168
rotation = 30
sky_projection = "ZPN"
projection_parameters = [0, 1, 0, 50]
[spectrum]
bands = ["sdss_g"]
)";

TEST(RenderParameters, ReadsEveryKey) {
  const RenderParameters p = parameters_of(other_values);
  EXPECT_EQ(p.width, 640);
  EXPECT_EQ(p.height, 480);
  EXPECT_EQ(p.image.output.path, "a \"b\".fits.fz");
  EXPECT_EQ(p.image.output.bitpix, -64);
  EXPECT_EQ(p.image.output.layout, ImageLayout::files);
  EXPECT_EQ(p.camera.projection, Projection::orthographic);
  EXPECT_EQ(p.camera.position, glm::dvec3(1.5, -2, 3));
  EXPECT_EQ(p.camera.target, glm::dvec3(0.1, 0, 0));
  EXPECT_EQ(p.camera.up, glm::dvec3(0, 1, 0));
  EXPECT_EQ(p.camera.width, 1e-7);
  EXPECT_EQ(p.camera.supersample, 4);
  EXPECT_EQ(p.spectrum.wavelengths, (std::vector<double>{4400, 5500.25, 8140}));
  EXPECT_EQ(p.spectrum.wavelengths_where.text(), "render.par:25:15");
  EXPECT_EQ(p.spectrum.bands, (std::vector<std::string>{"sdss_g", "my.band"}));
  EXPECT_EQ(p.spectrum.bands_where.text(), "render.par:26:9");
  EXPECT_EQ(p.spectrum.band_samples, 3);
  EXPECT_EQ(p.spectrum.igm, Igm::madau95);
  EXPECT_EQ(p.image.unit, PixelUnit::megajansky_per_sr);
  EXPECT_EQ(p.photometry.reference_band, "bessell_v");
  EXPECT_TRUE(p.photometry.attenuated);
  EXPECT_EQ(p.photometry.area, 4.5);
  EXPECT_EQ(p.photometry.throughput, 0.6);
  EXPECT_EQ(p.cosmology.h0(), 67.7);
  EXPECT_EQ(p.cosmology.omega_m(), 0.31);
  EXPECT_EQ(p.catalogue.format, CatalogueFormat::sextractor);
  EXPECT_EQ(p.catalogue.hdu, "OBJECTS");
  EXPECT_TRUE(p.catalogue.skip_flagged);
  EXPECT_EQ(p.catalogue.columns, (ColumnMap{{"x", "X_WORLD"}, {"seed", "=7"}}));
  EXPECT_EQ(p.truth.parts, TruthSettings::Parts::components);
  EXPECT_TRUE(p.truth.dust_free && p.truth.optical_depth && p.truth.segmentation);
  EXPECT_EQ(p.truth.path, "t.fits");
  EXPECT_EQ(p.image.output.style.brightness, 1.5);
  EXPECT_EQ(p.image.output.style.contrast, 2.5);
  EXPECT_EQ(p.image.output.style.seeing, 0);  // a FITS image has none
  EXPECT_EQ(p.image.output.style.saturation, 2);
  EXPECT_EQ(p.image.output.style.sky, 0.05);
  EXPECT_EQ(p.image.output.style.grain, 0.01);
  EXPECT_EQ(p.image.output.style.grain_seed, 3U);
  EXPECT_EQ(p.megaparsec(), 1e-3);
  EXPECT_EQ(p.noise.kind->name(), "perlin");
  EXPECT_EQ(p.noise.octaves, 5);
  EXPECT_EQ(p.noise.seed, 9223372036854775807u);
  EXPECT_EQ(p.sampling.sampler, SamplerKind::uniform);
  EXPECT_EQ(p.sampling.step, 0.005);
  EXPECT_EQ(p.sampling.tolerance, 0.01);
  EXPECT_EQ(p.scene.unit, "kpc");
}

TEST(RenderParameters, ReadsASkyView) {
  const RenderParameters p = parameters_of(sky_values);
  EXPECT_EQ(p.camera.projection, Projection::sky);
  EXPECT_EQ(p.camera.sky.projection, "ZPN");
  EXPECT_EQ(p.camera.sky.parameters, (std::vector<double>{0, 1, 0, 50}));
  EXPECT_EQ(p.camera.sky.center.ra, 150.25);
  EXPECT_EQ(p.camera.sky.center.dec, -2.5);
  EXPECT_EQ(p.camera.sky.pixel_scale, 0.168);
  EXPECT_EQ(p.camera.sky.rotation, 30);
  EXPECT_EQ(p.megaparsec(), 1);
  EXPECT_EQ(parameters_of(p.toml()).toml(), p.toml());
  for (const char* key : {"position", "target", "up", "fov", "width"}) {
    EXPECT_FALSE(p.applies("camera", key)) << key;
  }
}

// With bands alone, the default wavelength is neither a plane nor written.
TEST(RenderParameters, BandsReplaceTheDefaultWavelength) {
  const RenderParameters p = parameters_of(sky_values);
  EXPECT_TRUE(p.spectrum.wavelengths.empty());
  EXPECT_TRUE(parameters_of(p.toml()).spectrum.wavelengths.empty());
  const RenderParameters both =
      parameters_of("[spectrum]\nwavelengths = [5500]\nbands = [\"sdss_g\"]\n");
  EXPECT_EQ(both.spectrum.wavelengths, std::vector<double>{5500});
}

TEST(RenderParameters, AHeaderStandsForTheKeysOfTheView) {
  const RenderParameters p = parameters_of("[camera]\nprojection = \"sky\"\nheader = \"a.fits\"\n");
  EXPECT_EQ(p.camera.header, "a.fits");
  EXPECT_EQ(p.camera.header_where.text(), "render.par:3:10");
  for (const char* key : {"center", "pixel_scale", "rotation", "sky_projection"}) {
    EXPECT_FALSE(p.applies("camera", key)) << key;
  }
  EXPECT_EQ(parameters_of(p.toml()).toml(), p.toml());
}

TEST(RenderParameters, PicturesWithSeeingHaveSpikesOnce) {
  const auto style_of = [](const std::string& keys) {
    return parameters_of("[image]\nseeing = 2\n" + keys).image.output.style;
  };
  EXPECT_EQ(style_of("output = \"a.png\"\n[stars]\nspikes = 0.1").seeing, 2);
  EXPECT_EQ(style_of("output = \"a.png\"\n[stars]\nspikes = 0.1").spikes, 0.1);
  EXPECT_EQ(style_of("output = \"a.png\"\n[stars]\ndiscs = true\nspikes = 0.1").spikes, 0);
  // A FITS image has no style.
  EXPECT_EQ(style_of("output = \"a.fits\"\n[camera]\nprojection = \"healpix\"").seeing, 0);
}

TEST(RenderParameters, PicturesWithSeeingShowStarsAsPoints) {
  const auto draws_discs = [](const std::string& keys) {
    return parameters_of("[image]\n" + keys).draws_star_discs();
  };
  EXPECT_TRUE(draws_discs("output = \"a.png\""));
  EXPECT_FALSE(draws_discs("output = \"a.png\"\nseeing = 1"));
  EXPECT_TRUE(draws_discs("output = \"a.png\"\nseeing = 1\n[stars]\ndiscs = true"));
  EXPECT_FALSE(draws_discs("output = \"a.fits\""));
  EXPECT_TRUE(draws_discs("output = \"a.fits\"\n[stars]\nwhite_point = 3"));
}

TEST(RenderParameters, TomlReadsBackToTheSame) {
  EXPECT_EQ(parameters_of(other_values).toml(), other_values);
  const std::string defaults = RenderParameters().toml();
  EXPECT_EQ(parameters_of(defaults).toml(), defaults);
}

TEST(RenderParameters, TomlHoldsEveryDeclaredKeyThatApplies) {
  const RenderParameters defaults;
  const ConfigNode root = parse_toml(defaults.toml(), "resolved");
  for (const ParameterSection& section : render_parameter_sections()) {
    const ConfigNode* node = root.find(section.name);
    for (const Parameter& parameter : section.table) {
      const bool expected = defaults.applies(section.name, parameter.name) &&
                            defaults.section(section.name).has(parameter.name);
      EXPECT_EQ(node != nullptr && node->find(parameter.name) != nullptr, expected)
          << section.name << "." << parameter.name;
    }
  }
}

TEST(RenderParameters, EveryDeclaredNumberIsHeldToItsInterval) {
  for (const ParameterSection& section : render_parameter_sections()) {
    for (const Parameter& parameter : section.table) {
      EXPECT_FALSE(parameter.description.empty()) << parameter.name;
      const bool is_number =
          parameter.type == ParameterType::number || parameter.type == ParameterType::integer;
      if (!is_number || parameter.interval.low == Interval::any().low) continue;
      const std::string text =
          parameter.type == ParameterType::integer
              ? std::to_string(static_cast<long long>(parameter.interval.low) - 1)
              : std::to_string(parameter.interval.low - 1);
      const std::string message = message_of(
          [&] { parameters_of("[" + section.name + "]\n" + parameter.name + " = " + text); });
      EXPECT_TRUE(message.starts_with("render.par:2:")) << message;
      EXPECT_NE(message.find("is outside " + parameter.interval.text()), std::string::npos)
          << message;
    }
  }
}

TEST(RenderParameters, SetReplacesAValue) {
  RenderParameters p;
  p.set("image", "size", std::vector<double>{30, 20});
  EXPECT_EQ(p.width, 30);
  EXPECT_EQ(p.height, 20);
  EXPECT_NE(p.toml().find("size = [30, 20]"), std::string::npos);
  EXPECT_NE(message_of([&] { p.set("sampling", "tolerance", 2.0); }), "");
}

struct BadInput {
  const char* toml;
  const char* message;
};

class BadParameters : public testing::TestWithParam<BadInput> {};

TEST_P(BadParameters, SaysWhereAndWhat) {
  EXPECT_EQ(message_of([] { parameters_of(GetParam().toml); }), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadParameters,
    testing::Values(
        BadInput{"[spectrum]\nwavelenghts = [5500]",
                 "render.par:2:1: unknown key 'wavelenghts' in [spectrum]; did you mean "
                 "'wavelengths'?"},
        BadInput{"[spectrm]\n",
                 "render.par:1:2: unknown section [spectrm]; did you mean 'spectrum'?"},
        BadInput{"size = 3\n", "render.par:1:1: unknown key 'size' outside of a section"},
        BadInput{"image = 3\n", "render.par:1:9: image must be a section [image], not an integer"},
        BadInput{"[[image]]\nsize = 3\n",
                 "render.par:1:1: image must be a section [image], not a list"},
        BadInput{"[image]\nbitpix = 16", "render.par:2:10: bitpix = 16 is neither -32 nor -64"},
        BadInput{"[image]\nsize = 0", "render.par:2:8: size = 0 is outside [1, 1000000] (pixels)"},
        BadInput{"[image]\nregion = [1, 2, 3]",
                 "render.par:2:10: region has 3 numbers, not 4: x, y of its lower left pixel, "
                 "width, height"},
        BadInput{"[image]\nregion = [1, 2, 3, 4.5]",
                 "render.par:2:10: region has 4.5, which is no whole number of pixels"},
        BadInput{"[image]\nregion = [1, 1, 2, 2]\n[camera]\nprojection = \"healpix\"",
                 "render.par:2:10: region belongs to camera.projection = \"perspective\" or "
                 "\"orthographic\" or \"sky\", but projection is \"healpix\""},
        BadInput{"[image]\nseeing = 1e-300\noutput = \"a.png\"",
                 "render.par:2:10: seeing = 1e-300 is below 0.1 pixels; 0 shows the pixels as they "
                 "are"},
        BadInput{"[image]\nseeing = 2\noutput = \"a.png\"\nunit = \"mag/arcsec^2\"",
                 "render.par:2:10: seeing needs a unit of light, but image.unit is a magnitude"},
        BadInput{"[image]\nseeing = 2\noutput = \"a.png\"\n[camera]\nprojection = \"cubemap\"",
                 "render.par:2:10: seeing belongs to camera.projection = \"perspective\", "
                 "\"orthographic\", \"sky\" or \"fisheye\", but projection is \"cubemap\""},
        BadInput{"[image]\nlayout = \"stamps\"",
                 "render.par:2:10: layout = \"stamps\": stamps belong to camera.projection = "
                 "\"sky\", but projection is \"perspective\""},
        BadInput{"[stamps]\nsize = 20",
                 "render.par:2:8: size = 20: a stamp has an odd number of pixels on a side, so "
                 "that one is its middle"},
        BadInput{"[stamps]\nsmallest = 31\nlargest = 15",
                 "render.par:2:12: smallest = 31 is above largest = 15"},
        BadInput{"[camera]\nfov = nan", "render.par:2:7: fov = nan is not finite"},
        BadInput{"[camera]\nposition = [0, inf, 0]",
                 "render.par:2:16: position[1] = inf is not finite"},
        BadInput{"[camera]\nprojection = \"orthographic\"\nfov = 30",
                 "render.par:3:7: camera.fov belongs to projection = \"perspective\" or "
                 "\"fisheye\", but "
                 "projection is \"orthographic\""},
        BadInput{"[camera]\nwidth = 3",
                 "render.par:2:9: camera.width belongs to projection = \"orthographic\", but "
                 "projection is \"perspective\""},
        BadInput{"[sampling]\nstep = 0.1",
                 "render.par:2:8: sampling.step belongs to sampler = \"uniform\", but sampler is "
                 "\"adaptive\""},
        BadInput{"[camera]\ntarget = [0, -3, 0]",
                 "render.par:2:10: camera.target = [0, -3, 0] is camera.position: the view has "
                 "no direction"},
        BadInput{"[camera]\nposition = [0, 0, 0]",
                 "render.par:2:12: camera.target = [0, 0, 0] is camera.position: the view has no "
                 "direction"},
        BadInput{"[camera]\nposition = [1e200, 0, 0]",
                 "render.par:2:12: camera.target = [0, 0, 0] is too far from camera.position = "
                 "[1e+200, 0, 0]"},
        BadInput{"[camera]\nup = [0, 0, 0]",
                 "render.par:2:6: camera.up = [0, 0, 0] is no direction"},
        BadInput{"[camera]\nposition = [0, 0, 5]",
                 "render.par:2:12: camera.up = [0, 0, 1] is parallel to the view from "
                 "camera.position = [0, 0, 5] to camera.target = [0, 0, 0]"},
        BadInput{"[camera]\nup = [0, -2, 1e-10]",
                 "render.par:2:6: camera.up = [0, -2, 1e-10] is parallel to the view from "
                 "camera.position = [0, -3, 0] to camera.target = [0, 0, 0]"},
        BadInput{"[spectrum]\nwavelengths = []",
                 "render.par:2:15: wavelengths is empty; give one wavelength (Angstrom) or more, "
                 "or bands"},
        BadInput{"[spectrum]\nbands = [\"sdss_g\", \"b\", \"sdss_g\"]",
                 "render.par:2:9: bands has 'sdss_g' twice"},
        BadInput{"[spectrum]\nbands = \"sdss_g\"",
                 "render.par:2:9: bands must be a list of strings, not a string"},
        BadInput{"[spectrum]\nband_samples = 65",
                 "render.par:2:16: band_samples = 65 is outside [1, 64]"},
        BadInput{"[image]\nunit = \"electron/s\"",
                 "render.par:2:8: unit = \"electron/s\" needs photometry.area, the telescope's "
                 "collecting area (m^2)"},
        BadInput{"[image]\nunit = \"electron/s\"\n[photometry]\narea = 1\n[spectrum]\n"
                 "wavelengths = [5500]\nbands = [\"sdss_g\"]\n",
                 "render.par:2:8: unit = \"electron/s\" needs spectrum.bands alone: no electrons "
                 "come from a single wavelength"},
        BadInput{"[image]\nunit = \"nJ\"",
                 "render.par:2:8: unit = 'nJ' is none of \"auto\", \"relative\", \"nJy\", "
                 "\"MJy/sr\", \"mag/arcsec^2\", \"erg/s/cm^2/A/arcsec^2\", \"electron/s\"; did "
                 "you mean 'nJy'?"},
        BadInput{"[camera]\nprojection = \"sky\"\ncenter = [10, 91]",
                 "render.par:3:10: center = [10, 91]: the declination is outside [-90, 90] (deg)"},
        BadInput{"[camera]\nprojection = \"sky\"\ncenter = 10",
                 "render.par:3:10: center must be a list of two numbers, not an integer"},
        BadInput{"[camera]\ncenter = [10, 20]",
                 "render.par:2:10: camera.center belongs to projection = \"sky\", but projection "
                 "is \"perspective\""},
        BadInput{"[camera]\nprojection = \"sky\"\nup = [0, 0, 1]",
                 "render.par:3:6: camera.up belongs to projection = \"perspective\" or "
                 "\"orthographic\" or \"fisheye\" or \"equirectangular\" or \"cubemap\" or "
                 "\"healpix\", but projection is \"sky\""},
        BadInput{"[camera]\nprojection = \"sky\"\nheader = \"a.fits\"\nrotation = 3",
                 "render.par:4:12: camera.header gives camera.rotation too; give one of them"},
        BadInput{"[cosmology]\nOmega_m = 1.5", "render.par:2:11: Omega_m = 1.5 is outside [0, 1]"},
        BadInput{"[catalogue]\nRA = \"ALPHA\"",
                 "render.par:2:1: unknown key 'RA' in [catalogue]; did you mean 'ra' or 'pa'?"},
        BadInput{"[spectrum]\nwavelengths = [5500, 4400, 5.5e3]",
                 "render.par:2:15: wavelengths has 5500 A twice"},
        BadInput{"[spectrum]\nwavelengths = [0]",
                 "render.par:2:16: wavelengths[0] = 0 is outside ]0, inf[ (Angstrom)"},
        BadInput{"[noise]\nkind = \"simplx\"",
                 "render.par:2:8: kind = 'simplx' is none of \"simplex\", \"perlin\", \"value\", "
                 "\"cell\"; did you "
                 "mean 'simplex'?"}));

TEST(RenderParameters, AHealpixMapHasNoSizeButItsNside) {
  const auto with = [](const std::string& file, const std::vector<std::string>& settings) {
    ConfigNode root = parse_toml(file, "render.par");
    for (const std::string& setting : settings) set_from_text(root, setting);
    return RenderParameters::read(root);
  };
  const std::string sized = "[image]\nsize = 8\n", healpix = "[camera]\nprojection = \"healpix\"\n";
  EXPECT_EQ(
      message_of([&] { with(sized + healpix, {}); }),
      "render.par:2:8: image.size belongs to other projections; camera.nside sets the size of "
      "a HEALPix map, by default 128: leave image.size out");
  EXPECT_EQ(message_of([&] {
              with(healpix, {"camera.nside=4", "image.size=8"});
            }),
            "--set image.size: image.size belongs to other projections; camera.nside sets the size "
            "of a HEALPix map, here 4: leave image.size out");
  // A file made for another view also serves for a map.
  const RenderParameters map = with(sized, {"camera.projection=healpix", "camera.nside=4"});
  EXPECT_EQ(map.width, 4);
  EXPECT_EQ(map.height, 48);
  EXPECT_EQ(map.toml().find("size"), std::string::npos);
  EXPECT_EQ(parameters_of(map.toml()).toml(), map.toml());
}

}  // namespace
}  // namespace gamer::render_parameters_test
