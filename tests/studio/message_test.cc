#include "studio/message.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace gamer::message_test {
namespace {

/// The message of the error for a text.
std::string problem(const std::string& text) {
  try {
    parse_message(text);
  } catch (const BadMessage& error) {
    return error.what();
  }
  return "";
}

std::optional<std::int64_t> id_of_problem(const std::string& text) {
  try {
    parse_message(text);
  } catch (const BadMessage& error) {
    return error.id();
  }
  return -1;
}

TEST(Message, EveryOperation) {
  const auto index = [](const std::string& rest) {
    return parse_message(R"({"id":7,"op":)" + rest + "}").request.index();
  };
  const std::string document = R"("parameters":"","scene":"","galaxies":{})";
  EXPECT_EQ(index(R"("open")"), 0u);
  EXPECT_EQ(index(R"("edit","galaxy_text":"","edits":[])"), 1u);
  EXPECT_EQ(index(R"("edit_parameters","parameters":"","edits":[])"), 1u);
  EXPECT_EQ(index(R"("edit_scene","scene":"","edits":[{"set":[0,"x",1]},{"delete":2}])"), 2u);
  EXPECT_EQ(index(R"("galaxy","galaxy":"m51")"), 3u);
  EXPECT_EQ(index(R"("model","galaxy_text":"")"), 4u);
  EXPECT_EQ(index(R"("view",)" + document + R"(,"sizes":[[1,1,null]])"), 5u);
  EXPECT_EQ(index(R"("cancel")"), 6u);
  EXPECT_EQ(index(R"("save","galaxy":"x","galaxy_text":"")"), 7u);
  EXPECT_EQ(index(R"("save_as","name":"x","galaxy_text":"")"), 7u);
  EXPECT_EQ(index(R"("save_scene","scene":"")"), 8u);
  EXPECT_EQ(index(R"("command",)" + document), 9u);
  EXPECT_EQ(index(R"("render","name":"x.fits",)" + document), 10u);
  EXPECT_EQ(index(R"("outputs")"), 11u);
  EXPECT_EQ(index(R"("draft",)" + document + R"(,"size":64)"), 12u);
  EXPECT_EQ(index(R"("fix_orientations",)" + document), 13u);
}

TEST(Message, EditsOfArmsAndRows) {
  const Message arms = parse_message(
      R"({"op":"edit","id":1,"galaxy_text":"","edits":[{"add_arm":true},{"clone_arm":1},)"
      R"({"delete_arm":2},{"move_arm":[0,3]},{"delete":4}]})");
  const auto& edits = std::get<EditRequest>(arms.request).edits;
  EXPECT_TRUE(std::holds_alternative<AddArmEdit>(edits[0]));
  EXPECT_EQ(std::get<CloneEdit>(edits[1]).list, TextList::arms);
  EXPECT_EQ(std::get<DeleteEdit>(edits[2]).index, 2);
  EXPECT_EQ(std::get<MoveEdit>(edits[3]).to, 3);
  EXPECT_EQ(std::get<DeleteEdit>(edits[4]).list, TextList::components);
  const Message rows = parse_message(
      R"({"op":"edit_scene","id":1,"scene":"s","edits":[{"set":[0,"x",1.5]},{"set":[1,"sed",null]},)"
      R"({"set":[1,"galaxy","m51"]},{"add":[2,"lmc"]},{"clone":3}]})");
  const auto& scene = std::get<EditSceneRequest>(rows.request).edits;
  EXPECT_EQ(std::get<SetCellEdit>(scene[0]).word, "1.5");
  EXPECT_EQ(std::get<SetCellEdit>(scene[1]).word, "-");
  EXPECT_EQ(std::get<SetCellEdit>(scene[2]).word, "m51");
  EXPECT_EQ(std::get<AddRowEdit>(scene[3]).galaxy, "lmc");
  EXPECT_EQ(std::get<CloneRowEdit>(scene[4]).row, 3);
}

TEST(Message, View) {
  const Message message = parse_message(
      R"({"op":"view","id":-3,"parameters":"p","scene":"s","galaxies":{"a":"t"},"chosen":"a",)"
      R"("settings":["camera.fov=3"],"planes":"components","muted":[0,2],)"
      R"("sizes":[[64,32,0.05],[128,64,null]]})");
  EXPECT_EQ(message.id, -3);
  const auto& view = std::get<ViewRequest>(message.request);
  EXPECT_EQ(view.document.parameters, "p");
  EXPECT_EQ(view.document.scene, "s");
  EXPECT_EQ(view.document.galaxies.at("a"), "t");
  EXPECT_EQ(view.document.settings, std::vector<std::string>{"camera.fov=3"});
  EXPECT_EQ(view.document.chosen, "a");
  EXPECT_TRUE(view.wants_components);
  EXPECT_EQ(view.muted, (std::vector<int>{0, 2}));
  ASSERT_EQ(view.levels.size(), 2u);
  EXPECT_EQ(view.levels[0].tolerance, 0.05);
  EXPECT_EQ(view.levels[1].width, 128);
  EXPECT_FALSE(view.levels[1].tolerance);
}

TEST(Message, ValuesOfEditsAreToml) {
  const auto value = [](const std::string& json) {
    const Message message = parse_message(
        R"({"op":"edit","id":1,"galaxy_text":"","edits":[{"set":[0,"a",)" + json + "]}]}");
    return std::get<SetEdit>(std::get<EditRequest>(message.request).edits.at(0)).value;
  };
  EXPECT_EQ(value("3"), "3");
  EXPECT_EQ(value("-3"), "-3");
  EXPECT_EQ(value("0.1"), "0.1");
  EXPECT_EQ(value("1e300"), "1e+300");
  EXPECT_EQ(value("true"), "true");
  EXPECT_EQ(value("[1,2.5,[3]]"), "[1, 2.5, [3]]");
  EXPECT_EQ(value(R"("a\"b\\c\nd")"), R"("a\"b\\c\u000Ad")");
  EXPECT_EQ(value(R"("\" # = [")"), R"("\" # = [")");
}

TEST(Message, WrongMessagesAreErrors) {
  EXPECT_EQ(problem(""), "a message is no JSON");
  EXPECT_EQ(problem("{"), "a message is no JSON");
  EXPECT_EQ(problem("[1]"), "a message is no object");
  EXPECT_EQ(problem("{}"), "a message lacks 'id'");
  EXPECT_EQ(problem(R"({"id":1})"), "a message lacks 'op'");
  EXPECT_EQ(problem(R"({"id":1,"op":"opne"})"), "there is no operation 'opne'");
  EXPECT_EQ(problem(R"({"id":1,"op":"open","x":2})"), "a message has no 'x'");
  EXPECT_EQ(problem(R"({"id":1.5,"op":"open"})"),
            "'id' is no whole number from -9223372036854775808 to 9223372036854775807");
  EXPECT_EQ(problem(R"({"id":1,"op":"model","galaxy_text":3})"), "'galaxy_text' is no text");
  EXPECT_EQ(problem(R"({"id":1,"op":"model","galaxy_text":"a\u0000b"})"),
            "'galaxy_text' has NUL bytes");
  EXPECT_EQ(problem(std::string(100000, '[')), "a message is nested too deep");
  EXPECT_EQ(problem(std::string(most_message_bytes + 1, ' ')), "a message is too long");
  // Brackets within strings are not counted.
  EXPECT_EQ(problem(R"({"id":1,"op":"[[[[[[[[[[[[[[[[[[[[[[[[[[[[\"[[["})"),
            R"(there is no operation '[[[[[[[[[[[[[[[[[[[[[[[[[[[["[[[')");
  // Bytes that are not UTF-8.
  EXPECT_EQ(problem("{\"id\":1,\"op\":\"\xff\"}"), "a message is no JSON");
}

TEST(Message, LimitsOfViews) {
  const auto view = [](const std::string& rest) {
    return problem(R"({"id":1,"op":"view","parameters":"","scene":"","galaxies":{},)" + rest + "}");
  };
  EXPECT_EQ(view(R"("sizes":[])"), "'sizes' is empty");
  EXPECT_EQ(view(R"("sizes":[[0,1,1]])"), "'width' is no whole number from 1 to 16384");
  EXPECT_EQ(view(R"("sizes":[[1,16385,1]])"), "'height' is no whole number from 1 to 16384");
  EXPECT_EQ(view(R"("sizes":[[1,1,"a"]])"), "a tolerance is a number");
  EXPECT_EQ(view(R"("sizes":[[1,1]])"), "'sizes' is a list of 3");
  EXPECT_EQ(view(R"("planes":"all","sizes":[[1,1,1]])"), "'planes' is \"image\" or \"components\"");
  EXPECT_EQ(view(R"("muted":[-1],"sizes":[[1,1,1]])"),
            "'component' is no whole number from 0 to 2147483647");
  std::string many = "[1,1,1]";
  for (int i = 0; i < 16; ++i) many += ",[1,1,1]";
  EXPECT_EQ(view(R"("sizes":[)" + many + "]"), "'sizes' has more than 16 members");
}

TEST(Message, Draft) {
  const std::string begin =
      R"({"op":"draft","id":3,"parameters":"p","scene":"s","galaxies":{"a":"t"},"muted":[2],)";
  const Message message = parse_message(begin + R"("size":128})");
  const auto& draft = std::get<DraftRequest>(message.request);
  EXPECT_EQ(draft.document.galaxies.at("a"), "t");
  EXPECT_EQ(draft.muted, std::vector<int>{2});
  EXPECT_EQ(draft.size, 128);
  const std::string limits = "'size' is no whole number from 16 to 256";
  EXPECT_EQ(problem(begin + R"("size":15})"), limits);
  EXPECT_EQ(problem(begin + R"("size":257})"), limits);
  EXPECT_EQ(problem(begin + R"("size":"x"})"), limits);
  EXPECT_EQ(problem(begin + R"("more":1})"), "a message lacks 'size'");
}

TEST(Message, ErrorsHaveTheIdWhereThereIsOne) {
  EXPECT_EQ(id_of_problem(R"({"id":12,"op":"x"})"), 12);
  EXPECT_EQ(id_of_problem(R"({"op":"x"})"), std::nullopt);
  EXPECT_EQ(id_of_problem("nothing"), std::nullopt);
}

TEST(JsonText, ReplacesWhatIsNotUtf8) {
  EXPECT_EQ(json_text({{"a", "\xff"}}), "{\"a\":\"\xef\xbf\xbd\"}");
}

}  // namespace
}  // namespace gamer::message_test
