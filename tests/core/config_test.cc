#include "gamer/core/config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/error_text.h"

namespace gamer::config_test {
namespace {

std::string parse_error(const std::string& text) {
  return error_text([&] { parse_toml(text, "a.par"); });
}

template <typename T>
T value_at(const ConfigNode& root, const char* section, const char* key) {
  return std::get<T>(root.find(section)->find(key)->data);
}

TEST(ParseToml, ValuesOfEveryType) {
  const ConfigNode root = parse_toml(
      "flag = true\ncount = -3\nx = 1.5\nname = \"é\\\"q\"\nlist = [1, 2.5, [\"a\"]]\n"
      "[s]\nbig = 9223372036854775807\nhex = 0x10\n",
      "a.par");
  EXPECT_EQ(std::get<bool>(root.find("flag")->data), true);
  EXPECT_EQ(std::get<std::int64_t>(root.find("count")->data), -3);
  EXPECT_EQ(std::get<double>(root.find("x")->data), 1.5);
  EXPECT_EQ(std::get<std::string>(root.find("name")->data), "é\"q");
  const auto& list = root.find("list")->array();
  ASSERT_EQ(list.size(), 3u);
  EXPECT_EQ(std::get<std::int64_t>(list[0].data), 1);
  EXPECT_EQ(std::get<double>(list[1].data), 2.5);
  EXPECT_EQ(std::get<std::string>(list[2].array().at(0).data), "a");
  EXPECT_EQ(value_at<std::int64_t>(root, "s", "big"), INT64_MAX);
  EXPECT_EQ(value_at<std::int64_t>(root, "s", "hex"), 16);
  EXPECT_EQ(root.find("absent"), nullptr);
  EXPECT_EQ(root.find("count")->find("x"), nullptr);
}

TEST(ParseToml, KeysKeepTheOrderOfTheFile) {
  const ConfigNode root = parse_toml("[z]\nb = 1\na = 2\n[m]\n[a]\n", "a.par");
  ASSERT_EQ(root.table().size(), 3u);
  EXPECT_EQ(root.table()[0].first, "z");
  EXPECT_EQ(root.table()[1].first, "m");
  EXPECT_EQ(root.table()[2].first, "a");
  EXPECT_EQ(root.table()[0].second.table()[0].first, "b");
}

TEST(ParseToml, KnowsWhereThingsStand) {
  const ConfigNode root =
      parse_toml("# é\n  [image]\n  size   = [10,\n    20]\n[[component]]\nx = 1\n", "a.par");
  EXPECT_EQ(root.where.text(), "a.par");
  const ConfigNode* image = root.find("image");
  EXPECT_EQ(image->where.text(), "a.par:2:3");
  EXPECT_EQ(image->key_where.text(), "a.par:2:4");
  const ConfigNode* size = image->find("size");
  EXPECT_EQ(size->key_where.text(), "a.par:3:3");
  EXPECT_EQ(size->where.text(), "a.par:3:12");
  EXPECT_EQ(size->array()[1].where.text(), "a.par:4:5");
  EXPECT_EQ(size->array()[1].key_where.text(), "a.par:4:5");
  EXPECT_EQ(root.find("component")->array()[0].where.text(), "a.par:5:1");
}

TEST(ParseToml, NotANumberAndInfinityAreLeftToTheReader) {
  const ConfigNode root = parse_toml("a = nan\nb = -inf\n", "a.par");
  EXPECT_TRUE(std::isnan(std::get<double>(root.find("a")->data)));
  EXPECT_TRUE(std::isinf(std::get<double>(root.find("b")->data)));
}

TEST(ParseToml, DuplicateKeys) {
  EXPECT_EQ(parse_error("a = 1\na = 2\n"), "a.par:2:5: duplicate key 'a'");
  EXPECT_EQ(parse_error("s = {a = 1, a = 2}\n"), "a.par:1:17: duplicate key 'a'");
  EXPECT_EQ(parse_error("[s]\nx = 1\n[s]\n"), "a.par:3:1: duplicate table 's'");
  EXPECT_EQ(parse_error("s = 1\n[s]\n"), "a.par:2:1: duplicate key 's'");
}

TEST(ParseToml, SyntaxErrors) {
  EXPECT_EQ(parse_error("a = \n"),
            "a.par:1:5: cannot read key-value pair: expected value, saw '\\n'");
  EXPECT_EQ(parse_error("x\n"), "a.par:1:2: cannot read key-value pair: expected '=', saw '\\n'");
  EXPECT_EQ(parse_error("a = [1, 2"), "a.par:1:10: cannot read array: encountered end-of-file");
  EXPECT_EQ(parse_error("\na = abc\n"), "a.par:2:5: this is no TOML value; a text needs quotes");
  EXPECT_EQ(parse_error("a = \"\xff\"\n"),
            "a.par:1:5: not valid TOML: Encountered invalid utf-8 sequence");
}

TEST(ParseToml, DatesAreErrors) {
  const std::string message = "dates and times are not used here; a text needs quotes";
  EXPECT_EQ(parse_error("a = 1979-05-27\n"), "a.par:1:5: " + message);
  EXPECT_EQ(parse_error("a = [07:32:00]\n"), "a.par:1:6: " + message);
  EXPECT_EQ(parse_error("\na = 1979-05-27T07:32:00Z\n"), "a.par:2:5: " + message);
}

TEST(ParseToml, DepthIsBounded) {
  const auto nested = [](int depth) {
    return "a = " + std::string(depth, '[') + std::string(depth, ']');
  };
  EXPECT_NO_THROW(parse_toml(nested(64), "a.par"));
  EXPECT_EQ(parse_error(nested(65)), "a.par:1:69: nested deeper than 64 levels");
  EXPECT_FALSE(parse_error("a = " + std::string(1000000, '[')).empty());
  std::string tables;
  for (int i = 0; i < 1000; ++i) tables += "{a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a = ";
  EXPECT_FALSE(parse_error("a = " + tables).empty());
}

TEST(ParseToml, PartsOfAKeyAreBounded) {
  const auto dotted = [](int parts) {
    std::string key = "a";
    for (int i = 1; i < parts; ++i) key += i % 2 ? ".b" : " . 'a.a'";
    return key;
  };
  EXPECT_NO_THROW(parse_toml(dotted(16) + " = 1", "a.par"));
  EXPECT_EQ(parse_error("\n" + dotted(17) + " = 1"), "a.par:2: a key has more than 16 parts");
  EXPECT_EQ(parse_error("[" + dotted(1000000) + "]"), "a.par:1: a key has more than 16 parts");
  EXPECT_EQ(parse_error("a = {" + dotted(17) + " = 1}"), "a.par:1: a key has more than 16 parts");
  // The text ends at the quote; the rest is no string.
  EXPECT_EQ(parse_error("a = {b = \"\"\"x\"\"\"\", " + dotted(1000000) + " = 1}"),
            "a.par:1: a key has more than 16 parts");
}

TEST(ParseToml, DotsElsewhereAreNoKeyParts) {
  const std::string dots(40, '.');
  const std::string text = "# " + dots + "\na = \"" + dots + "\\\"" + dots + "\"\nb = '" + dots +
                           "'\nc = \"\"\"\n" + dots + "\n\"q\" " + dots + "\"\"\"\nd = '''" + dots +
                           "\n" + dots + "'''\ne = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, " +
                           "0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]\n";
  const ConfigNode root = parse_toml(text, "a.par");
  EXPECT_EQ(root.table().size(), 5u);
  EXPECT_EQ(std::get<std::string>(root.find("d")->data), dots + "\n" + dots);
}

TEST(ConfigNode, TypeNames) {
  const ConfigNode root =
      parse_toml("a = true\nb = 1\nc = 1.0\nd = \"x\"\ne = []\nf = {}\n", "a.par");
  const char* const names[] = {"a boolean", "an integer", "a number",
                               "a string",  "a list",     "a table"};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(root.table()[i].second.type_name(), names[i]);
}

TEST(SetFromText, ReplacesAndCreates) {
  ConfigNode root = parse_toml("[image]\nsize = 10\noutput = \"a.fits\"\n", "a.par");
  set_from_text(root, "image.size=[20, 30]");
  set_from_text(root, " camera . fov = 12.5 ");
  set_from_text(root, "top=true");
  EXPECT_EQ(root.find("image")->table()[0].first, "size");
  EXPECT_EQ(std::get<std::int64_t>(root.find("image")->find("size")->array()[1].data), 30);
  EXPECT_EQ(value_at<std::string>(root, "image", "output"), "a.fits");
  EXPECT_EQ(value_at<double>(root, "camera", "fov"), 12.5);
  EXPECT_EQ(std::get<bool>(root.find("top")->data), true);
}

TEST(SetFromText, ABareWordIsAString) {
  ConfigNode root;
  for (const char* word :
       {"out.fits", "dir/a b.fits", "1.5abc", "2026-01-02", "#3", "a=b", "\xc3\xa9\x7f\t\x01"}) {
    set_from_text(root, std::string("image.output=") + word);
    EXPECT_EQ(value_at<std::string>(root, "image", "output"), word);
  }
  set_from_text(root, "image.output=\"quoted\"");
  EXPECT_EQ(value_at<std::string>(root, "image", "output"), "quoted");
}

TEST(SetFromText, TheLocationIsTheOption) {
  ConfigNode root = parse_toml("[image]\nsize = 10\n", "a.par");
  set_from_text(root, "image.size=[20, 30]");
  const ConfigNode* size = root.find("image")->find("size");
  EXPECT_EQ(size->where.text(), "--set image.size");
  EXPECT_EQ(size->key_where.text(), "--set image.size");
  EXPECT_EQ(size->array()[0].where.text(), "--set image.size");
}

TEST(SetFromText, Errors) {
  ConfigNode root = parse_toml("[image]\nsize = 10\n", "a.par");
  const auto set_error = [&](const std::string& text) {
    return error_text([&] { set_from_text(root, text); });
  };
  EXPECT_EQ(set_error("image.size"), "--set: 'image.size' is not of the form section.key=value");
  EXPECT_EQ(set_error("=3"), "--set: '=3' is not of the form section.key=value");
  EXPECT_EQ(set_error("a..b=3"), "--set: 'a..b=3' is not of the form section.key=value");
  EXPECT_EQ(set_error(""), "--set: '' is not of the form section.key=value");
  EXPECT_EQ(set_error("image.size="), "--set image.size: needs a value after '='");
  EXPECT_EQ(set_error("image.size.x=1"), "--set image.size.x: 'size' is an integer, not a table");
  EXPECT_EQ(set_error("image.size=[1, 2"),
            "--set image.size: cannot read array: encountered end-of-file");
  EXPECT_EQ(set_error("image.size=1\nfov = 2"), "--set image.size: takes one value only");
  EXPECT_EQ(set_error("a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a=1"),
            "--set a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a: a key has more than 16 parts");
  EXPECT_EQ(set_error("image.output=\xff\xfe"), "--set image.output: the value is not valid UTF-8");
  // The two bytes of a letter, with a control character between them.
  EXPECT_EQ(set_error("image.output=x\xc7\x12\x82"),
            "--set image.output: the value is not valid UTF-8");
  EXPECT_EQ(value_at<std::int64_t>(root, "image", "size"), 10);
}

}  // namespace
}  // namespace gamer::config_test
