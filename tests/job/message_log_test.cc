#include "gamer/job/message_log.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

namespace gamer::message_log_test {
namespace {

/// A stream in memory.
class Stream {
 public:
  ~Stream() {
    if (file != nullptr) std::fclose(file);
    std::free(text_);
  }
  std::string text() {
    std::fflush(file);
    return {text_, size_};
  }

 private:
  char* text_ = nullptr;
  std::size_t size_ = 0;

 public:
  std::FILE* file = open_memstream(&text_, &size_);
};

struct Said {
  std::string out, err;
};

Said said(MessageLog::Format format, const std::function<void(MessageLog&)>& talk) {
  Stream out, err;
  MessageLog log(format, out.file, err.file, [] { return std::time_t{1000000000}; });
  talk(log);
  return {out.text(), err.text()};
}

void say_everything(MessageLog& log) {
  log.answer("an answer");
  log.result("x.fits: made");
  log.info("1 galaxy");
  log.warning("dark");
  log.error("a.par:1: wrong");
  log.table("gamer:  a  b\ngamer:  1  2\n");
}

TEST(MessageLog, Text) {
  const Said all = said(MessageLog::Format::text, say_everything);
  EXPECT_EQ(all.out, "an answer\nx.fits: made\n");
  EXPECT_EQ(all.err,
            "gamer: 1 galaxy\ngamer: warning: dark\na.par:1: wrong\ngamer:  a  b\ngamer:  1  2\n");
}

TEST(MessageLog, Json) {
  const Said all = said(MessageLog::Format::json, say_everything);
  EXPECT_EQ(all.out, "");
  const std::string start = R"({"time":"2001-09-09T01:46:40Z","level":")";
  EXPECT_EQ(all.err, start + "info\",\"text\":\"an answer\"}\n" +            //
                         start + "info\",\"text\":\"x.fits: made\"}\n" +     //
                         start + "info\",\"text\":\"1 galaxy\"}\n" +         //
                         start + "warning\",\"text\":\"dark\"}\n" +          //
                         start + "error\",\"text\":\"a.par:1: wrong\"}\n" +  //
                         start + "info\",\"text\":\" a  b\"}\n" +            //
                         start + "info\",\"text\":\" 1  2\"}\n");
}

TEST(MessageLog, QuietLeavesAnswersAndErrors) {
  const Said all = said(MessageLog::Format::text, [](MessageLog& log) {
    log.be_quiet();
    log.answer("an answer");
    log.result("made");
    log.info("1 galaxy");
    log.warning("dark");
    log.error("wrong");
  });
  EXPECT_EQ(all.out, "an answer\n");
  EXPECT_EQ(all.err, "wrong\n");
}

TEST(MessageLog, JsonEscapesEverything) {
  EXPECT_EQ(json_message("T", "info", "a\"b\\c\nd\x01 \xc3\xa9 \xff"),
            "{\"time\":\"T\",\"level\":\"info\",\"text\":"
            "\"a\\\"b\\\\c\\\\nd\\\\x01 \xc3\xa9 \\\\xff\"}\n");
}

TEST(MessageLog, ProgressHasNumbers) {
  EXPECT_EQ(json_message("T", "half", {5, 10, "rows", 0.25, 20}),
            R"({"time":"T","level":"progress","text":"half","done":5,"total":10,"unit":"rows",)"
            R"("rate":0.25,"left":20.0})"
            "\n");
  EXPECT_NE(json_message("T", "", {0, 10, "rows", 0, -1}).find(R"("rate":0,"left":null})"),
            std::string::npos);
}

TEST(MessageLog, FormatOfArguments) {
  const auto format = [](std::initializer_list<const char*> words) {
    std::vector<std::string> copies(words.begin(), words.end());
    std::vector<char*> arguments;
    for (std::string& word : copies) arguments.push_back(word.data());
    return log_format(arguments);
  };
  EXPECT_EQ(format({"gamer", "x.par"}), MessageLog::Format::text);
  EXPECT_EQ(format({"gamer", "--log", "json", "--bad"}), MessageLog::Format::json);
  EXPECT_EQ(format({"gamer", "--log=json"}), MessageLog::Format::json);
  EXPECT_EQ(format({"gamer", "--log", "text"}), MessageLog::Format::text);
  EXPECT_EQ(format({"gamer", "--log"}), MessageLog::Format::text);
}

}  // namespace
}  // namespace gamer::message_log_test
