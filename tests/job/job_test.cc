#include "gamer/job/job.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "gamer/core/version.h"
#include "job/completed.h"

namespace gamer::job_test {
namespace {

using test::completed;

const char* const job_parameters =
    "[image]\nsize = [50, 30]\noutput = \"a.fits\"\n[camera]\nsupersample = 2\n"
    "[spectrum]\nwavelengths = [4400, 5500.25]\n";
const char* const job_scene = "galaxy x y z id # columns\nsmooth 1 0 0 -\nsmooth 2 0 0 b\n";
const char* const galaxy_text = "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = false\n";

Resources resources() {
  return Resources::from_record({{"render.par", "in/render.par", job_parameters},
                                 {"scene.lst", "in/scene.lst", job_scene},
                                 {"galaxies/smooth", "galaxies/smooth.toml", galaxy_text}});
}

RenderJob load(const JobRequest& request) {
  Resources data = resources();
  return load_job(request, data);
}

TEST(Job, BundlesWhatTheTextsSay) {
  const RenderJob job = load({});
  EXPECT_EQ(job.parameters.image.output.path, "a.fits");
  EXPECT_EQ(job.camera.width(), 50);
  EXPECT_EQ(job.scene->galaxies.size(), 2u);
  EXPECT_EQ(job.record.size(), 3u);
}

TEST(Job, RequestsChangeParameters) {
  JobRequest request;
  request.settings = {"camera.supersample=3", "image.size = [70, 60]"};
  request.output = "b.png";
  request.overwrite = true;
  const RenderJob job = load(request);
  EXPECT_EQ(job.parameters.camera.supersample, 3);
  EXPECT_EQ(job.camera.height(), 60);
  EXPECT_EQ(job.parameters.image.output.path, "b.png");
  EXPECT_TRUE(job.parameters.image.output.overwrite);
}

TEST(Job, PreviewIsSmallAndCoarse) {
  JobRequest request;
  request.preview = true;
  const RenderJob job = load(request);
  EXPECT_EQ(job.camera.width(), 13);
  EXPECT_EQ(job.camera.height(), 8);
  EXPECT_EQ(job.parameters.camera.supersample, 1);
  EXPECT_EQ(job.parameters.sampling.tolerance, 1e-2);
  request.settings = {"sampling.tolerance=0.1"};
  EXPECT_EQ(load(request).parameters.sampling.tolerance, 0.1);
}

TEST(Job, RecordHoldsResolvedParametersAndMakesTheSameJob) {
  JobRequest request;
  request.settings = {"noise.seed=17"};
  request.preview = true;
  const RenderJob job = load(request);
  const RenderJob again = completed(unpack_record(pack_record(job.record)));
  EXPECT_EQ(again.parameters.toml(), job.parameters.toml());
  EXPECT_EQ(again.parameters.noise.seed, 17u);
  ASSERT_EQ(again.scene->galaxies.size(), 2u);
  EXPECT_EQ(again.scene->galaxies[1].centre, job.scene->galaxies[1].centre);
  EXPECT_EQ(again.camera.ray(1, 2)->direction, job.camera.ray(1, 2)->direction);
}

TEST(Job, IsCompleteOnceItsGalaxiesAreMeasured) {
  const char* const galaxy =
      "[[component]]\nclass = \"disk\"\nsed = \"flat\"\nnoise = {octaves = 1}\n";
  Resources data = Resources::from_record(
      {{"render.par", "render.par", "[image]\nsize = 8\noutput = \"a.fits\"\n"},
       {"scene.lst", "scene.lst", "galaxy x y z seed\nn 0 0 0 2\nn 0.1 0 0 1\nn 0.2 0 0 2\n"},
       {"galaxies/n", "n.toml", galaxy}});
  const auto pixels = [](const RenderJob& job) {
    const Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum);
    std::vector<double> values(8 * 8);
    renderer.render_rows({0, 8}, values);
    return values;
  };
  RenderJob job = read_job(JobRequest(), data);
  // In the scene's order, which every rank has.
  ASSERT_EQ(job.pending.galaxies.size(), 2u);
  EXPECT_EQ(job.pending.galaxies[0], job.scene->galaxies[0].galaxy);
  EXPECT_EQ(job.pending.galaxies[1], job.scene->galaxies[1].galaxy);
  complete(job, Ranks(), 1);
  EXPECT_TRUE(job.pending.galaxies.empty());
  EXPECT_EQ(pixels(job), pixels(load_job({}, data)));
  EXPECT_EQ(pixels(job), pixels(completed(job.record)));
}

const Card* find_card(const ImageHeader& header, const std::string& key) {
  const auto found = std::find_if(header.cards.begin(), header.cards.end(),
                                  [&](const Card& card) { return card.key == key; });
  return found == header.cards.end() ? nullptr : &*found;
}

TEST(Job, HeaderDescribesTheImage) {
  const RenderJob job = load({});
  const ImageHeader header = make_image_header(job);
  EXPECT_EQ(header.width, 50);
  EXPECT_EQ(header.height, 30);
  EXPECT_EQ(header.unit, "");
  EXPECT_EQ(header.x.type, "XTAN");
  EXPECT_EQ(header.y.reference_pixel, 15.5);
  EXPECT_EQ(header.wavelengths, job.parameters.spectrum.wavelengths);
  EXPECT_EQ(header.labels, (std::vector<std::string>{"4400A", "5500.25A"}));
  ASSERT_NE(find_card(header, "CREATOR"), nullptr);
  EXPECT_EQ(std::get<std::string>(find_card(header, "CREATOR")->value),
            std::string("gamer ") + version());
  constexpr std::size_t comment_width = 72;  // of a COMMENT card
  for (const Card& card : header.cards) {
    if (card.key != "COMMENT") continue;
    EXPECT_LE(card.comment.size(), comment_width) << card.comment;
  }
}

TEST(Job, HeaderHasACardForEveryParameterThatApplies) {
  const RenderJob job = load({});
  const ImageHeader header = make_image_header(job);
  for (const ParameterSection& section : render_parameter_sections()) {
    for (const Parameter& parameter : section.table) {
      std::string key = "HIERARCH GAMER " + section.name + " " + parameter.name;
      std::transform(key.begin(), key.end(), key.begin(), ::toupper);
      const bool expected = job.parameters.applies(section.name, parameter.name) &&
                            job.parameters.section(section.name).has(parameter.name);
      EXPECT_EQ(find_card(header, key) != nullptr, expected) << key;
    }
  }
  EXPECT_EQ(std::get<long long>(find_card(header, "HIERARCH GAMER CAMERA SUPERSAMPLE")->value), 2);
  EXPECT_EQ(std::get<double>(find_card(header, "HIERARCH GAMER CAMERA FOV")->value), 45);
  EXPECT_EQ(std::get<std::string>(find_card(header, "HIERARCH GAMER IMAGE SIZE")->value),
            "[50, 30]");
}

TEST(Job, HeaderHoldsTheSceneAndTheRecord) {
  const ImageHeader header = make_image_header(load({}));
  ASSERT_EQ(header.data_tables.size(), 1u);
  const DataTable& scene = header.data_tables[0];
  EXPECT_EQ(scene.name, "SCENE");
  std::vector<std::string> names;
  for (const DataColumn& column : scene.columns) names.push_back(column.name);
  EXPECT_EQ(names, (std::vector<std::string>{"galaxy", "x", "y", "z", "id", "row"}));
  ASSERT_EQ(scene.rows(), 2u);
  EXPECT_EQ(std::get<std::vector<std::string>>(scene.columns[0].values)[1], "smooth");
  EXPECT_EQ(std::get<std::vector<double>>(scene.columns[1].values)[1], 2);
  EXPECT_EQ(std::get<std::vector<double>>(scene.columns[2].values)[1], 0);
  EXPECT_EQ(std::get<std::vector<double>>(scene.columns[3].values)[1], 0);
  EXPECT_EQ(std::get<std::vector<std::string>>(scene.columns[4].values)[1], "b");
  EXPECT_EQ(std::get<std::vector<std::int64_t>>(scene.columns[5].values)[1], 2);
  ASSERT_EQ(header.tables.size(), 1u);
  EXPECT_EQ(header.tables[0].name, "INPUTS");
  const RenderJob again = completed(record_from_table(header.tables[0]));
  EXPECT_EQ(again.scene->galaxies.size(), 2u);
}

TEST(Job, MemoryOfRows) {
  ImageHeader header;
  header.width = 1000000;
  header.height = 1000;
  header.labels.assign(100, "plane");
  EXPECT_NO_THROW(check_row_memory({}, 1, 1, 1));
  // 2 * 1000 + 3 blocks of a row of 800 MB each.
  try {
    check_row_memory(header, header.planes(), 1000, 1000);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("1.5 TiB of memory"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace gamer::job_test
