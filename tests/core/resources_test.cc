#include "gamer/core/resources.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "core/error_text.h"
#include "gamer/core/near.h"

namespace gamer::resources_test {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> toml = {".toml"};
const std::vector<std::string> sed = {".sed", ".txt"};

class ResourcesTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "gamer_resources_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    root_ = pattern;
  }
  void TearDown() override { fs::remove_all(root_); }

  std::string write(const std::string& name, const std::string& content) {
    const fs::path path = root_ / name;
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << content;
    return path.string();
  }
  std::string path(const std::string& name) const { return (root_ / name).string(); }

  fs::path root_;
};

TEST_F(ResourcesTest, FoldersInTheirOrder) {
  write("a/galaxies/m1.toml", "a1");
  write("b/galaxies/m1.toml", "b1");
  write("b/galaxies/m2.toml", "b2");
  Resources resources({root_ / "a", root_ / "b"});
  const Resources::Text& m1 = resources.find("galaxies", "m1", "", toml);
  EXPECT_EQ(m1.content, "a1");
  EXPECT_EQ(m1.name, "galaxies/m1");
  EXPECT_EQ(m1.label, path("a/galaxies/m1.toml"));
  EXPECT_EQ(resources.find("galaxies", "m2", "", toml).content, "b2");
  EXPECT_EQ(resources.find("galaxies", "m2.toml", "", toml).content, "b2");
}

TEST_F(ResourcesTest, BesideTheNamingFileFirst) {
  write("data/seds/E.sed", "shipped");
  write("mine/E.txt", "mine");
  const std::string galaxy = write("mine/m.toml", "");
  Resources resources({root_ / "data"});
  EXPECT_EQ(resources.find("seds", "E", galaxy, sed).content, "mine");
  EXPECT_EQ(resources.find("seds", "E", path("other/m.toml"), sed).content, "shipped");
  EXPECT_EQ(resources.find("seds", "E.txt", galaxy, sed).content, "mine");
}

TEST_F(ResourcesTest, PathsAreRelativeToTheNamingFile) {
  write("one/sub/E.sed", "one");
  write("two/sub/E.sed", "two");
  Resources resources({root_});
  for (const char* name : {"sub/E", "sub/E.sed", "./sub/E.sed", "../one/sub/E"}) {
    EXPECT_EQ(resources.find("seds", name, path("one/m.toml"), sed).content, "one") << name;
  }
  EXPECT_EQ(resources.find("seds", "sub/E.sed", path("two/m.toml"), sed).content, "two");
  EXPECT_EQ(resources.find("seds", path("two/sub/E.sed"), "elsewhere/m.toml", sed).content, "two");
}

TEST_F(ResourcesTest, TheRecordAloneServesTheSameTexts) {
  write("data/galaxies/m.toml", "bare");
  write("data/seds/E.sed", "shipped");
  write("one/m.toml", "one");
  write("one/E.sed", "one E");
  write("one/sub/E.sed", "one sub E");
  write("two/sub/E.sed", "two sub E");
  struct Request {
    const char* kind;
    const char* name;
    std::string beside;
  };
  const std::vector<Request> requests = {
      {"galaxies", "m", path("scene.lst")},     {"galaxies", "m", path("one/scene.lst")},
      {"galaxies", "./m", path("one/s.lst")},   {"seds", "E", path("one/m.toml")},
      {"seds", "E", path("two/m.toml")},        {"seds", "sub/E.sed", path("one/m.toml")},
      {"seds", "sub/E.sed", path("two/m.toml")}};
  const auto suffixes = [](const Request& r) { return std::string(r.kind) == "seds" ? sed : toml; };

  Resources disk({root_ / "data"});
  std::vector<std::string> contents;
  for (const Request& r : requests) {
    contents.push_back(disk.find(r.kind, r.name, r.beside, suffixes(r)).content);
  }
  EXPECT_EQ(contents, (std::vector<std::string>{"bare", "one", "one", "one E", "shipped",
                                                "one sub E", "two sub E"}));
  fs::remove_all(root_);
  Resources record = Resources::from_record(disk.record());
  for (std::size_t i = 0; i < requests.size(); ++i) {
    const Request& r = requests[i];
    EXPECT_EQ(record.find(r.kind, r.name, r.beside, suffixes(r)).content, contents[i]) << i;
  }
  EXPECT_EQ(record.record().size(), disk.record().size());
}

TEST_F(ResourcesTest, ARecordNeverTouchesTheDisk) {
  const std::string par = write("a.par", "x");
  write("galaxies/m1.toml", "disk");
  Resources record = Resources::from_record({{"galaxies/n1", "galaxies/n1.toml", "recorded"}});
  EXPECT_EQ(record.find("galaxies", "n1", "a.lst", toml).content, "recorded");
  EXPECT_EQ(error_text([&] { record.find("galaxies", "m1", par, toml); }),
            "unknown galaxy 'm1'; did you mean 'n1'?");
  EXPECT_EQ(error_text([&] { record.read("render.par", par); }),
            "the record holds no 'render.par'");
}

TEST_F(ResourcesTest, RelativeLabelsAreShort) {
  const fs::path before = fs::current_path();
  write("galaxies/m.toml", "x");
  fs::current_path(root_);
  Resources resources({"."});
  const Resources::Text text = resources.find("galaxies", "m", "scene.lst", toml);
  const Resources::Text again = resources.find("galaxies", "galaxies/m", "./scene.lst", toml);
  fs::current_path(before);
  EXPECT_EQ(text.label, "galaxies/m.toml");
  EXPECT_EQ(again.name, "galaxies/./galaxies/m.toml");
}

TEST_F(ResourcesTest, UnknownNames) {
  write("data/galaxies/ngc4321.toml", "");
  write("mine/ngc4322.toml", "");
  Resources resources({root_ / "data", root_ / "absent"});
  EXPECT_EQ(error_text([&] { resources.find("galaxies", "ngc4231", "", toml); }),
            "unknown galaxy 'ngc4231'; did you mean 'ngc4321'?");
  EXPECT_EQ(error_text([&] { resources.find("galaxies", "ngc4323", path("mine/s.lst"), toml); }),
            "unknown galaxy 'ngc4323'; did you mean 'ngc4321' or 'ngc4322'?");
  EXPECT_EQ(error_text([&] { resources.find("seds", "blue", "", sed); }),
            "unknown SED 'blue'; there is no blue.sed, blue.txt in '.', '" + path("data/seds") +
                "', '" + path("absent/seds") + "'");
  EXPECT_EQ(
      error_text([&] { resources.find("luminosities", "blue.lf", path("mine/a.toml"), sed); }),
      "unknown luminosity function 'blue.lf'; there is no blue.lf.sed, blue.lf.txt in '" +
          path("mine") + "', '" + path("data/luminosities") + "', '" + path("absent/luminosities") +
          "'");
  EXPECT_EQ(error_text([&] { resources.find("galaxies", "my/m", "mine/s.lst", toml); }),
            "there is no file 'mine/my/m' for galaxy 'my/m'");
  EXPECT_EQ(error_text([&] { resources.find("galaxies", "", "", toml); }),
            "the galaxy's name is empty");
  EXPECT_FALSE(
      error_text([&] { resources.find("galaxies", std::string(100000, 'a'), "", toml); }).empty());
}

TEST_F(ResourcesTest, FilesThatCannotServe) {
  Resources resources({root_});
  const auto read_error = [&](const std::string& file) {
    return error_text([&] { resources.read(file, file); });
  };
  EXPECT_EQ(read_error(path("none")), fmt::format("there is no file {}", in_quotes(path("none"))));
  EXPECT_EQ(read_error(root_.string()),
            fmt::format("{} is a directory", in_quotes(root_.string())));
  const std::string nul = write("nul", std::string("a\0b", 3));
  EXPECT_EQ(read_error(nul),
            fmt::format("{} has NUL bytes; it is not a text file", in_quotes(nul)));
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(read_error(path("pipe")),
            fmt::format("{} is not a regular file", in_quotes(path("pipe"))));
  const std::string large = write("large", "");
  fs::resize_file(large, (std::uintmax_t{1} << 30) + 1);
  EXPECT_EQ(read_error(large), fmt::format("{} is larger than 1024 MiB", in_quotes(large)));
  EXPECT_EQ(read_error(write("file", "") + "/x"),
            fmt::format("there is no file {}", in_quotes(path("file/x"))));
  fs::create_directories(root_ / "galaxies" / "m.toml");
  EXPECT_EQ(error_text([&] { resources.find("galaxies", "m", "", toml); }),
            fmt::format("{} is a directory", in_quotes(path("galaxies/m.toml"))));
}

TEST_F(ResourcesTest, UnreadableFile) {
  if (geteuid() == 0) GTEST_SKIP() << "root reads everything";
  const std::string file = write("secret", "x");
  fs::permissions(file, fs::perms::none);
  Resources resources({root_});
  EXPECT_EQ(error_text([&] { resources.read("secret", file); }),
            fmt::format("cannot read {}", in_quotes(file)));
}

TEST_F(ResourcesTest, ReadsBytesAsTheyAre) {
  const std::string content = "a\r\nb\n\xff";
  Resources resources({});
  const Resources::Text& text = resources.read("render.par", write("r.par", content));
  EXPECT_EQ(text.content, content);
  EXPECT_EQ(text.name, "render.par");
  EXPECT_EQ(text.label, path("r.par"));
}

TEST_F(ResourcesTest, NamesAndRecord) {
  write("a/seds/E.sed", "");
  write("b/seds/E.txt", "");
  write("b/seds/Im.txt", "");
  write("b/seds/readme.md", "");
  Resources resources({root_ / "b", root_ / "a"});
  EXPECT_EQ(resources.names("seds", sed), (std::vector<std::string>{"E", "Im"}));
  EXPECT_TRUE(resources.names("galaxies", toml).empty());
  resources.find("seds", "Im", "", sed);
  resources.add({"made", "made", "x"});
  resources.find("seds", "E", "", sed);
  std::vector<std::string> recorded;
  for (const auto& text : resources.record()) recorded.push_back(text.name);
  EXPECT_EQ(recorded, (std::vector<std::string>{"made", "seds/E", "seds/Im"}));
}

TEST(DefaultDataFolders, WorkingDirectoryThenEnvironmentThenData) {
  ASSERT_EQ(setenv("GAMER_DATA", "somewhere", 1), 0);
  const std::vector<fs::path> with = default_data_folders();
  ASSERT_EQ(unsetenv("GAMER_DATA"), 0);
  const std::vector<fs::path> without = default_data_folders();
  ASSERT_EQ(with.size(), 3u);
  EXPECT_EQ(with[0], ".");
  EXPECT_EQ(with[1], "somewhere");
  ASSERT_EQ(without.size(), 2u);
  EXPECT_EQ(without[0], ".");
  EXPECT_EQ(without[1], with[2]);
}

}  // namespace
}  // namespace gamer::resources_test
