#include "gamer/core/manual.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>

#include "core/error_text.h"

namespace gamer::manual_test {
namespace {

Manual some_manual() {
  Manual manual;
  manual.program = "paint";
  manual.version = "1.2";
  manual.summary = "paint things";
  manual.synopses = {"[options] in"};
  manual.description = "It isn't `--fast`.\n\n    paint 'x'\n\n.Dots and \xc3\x85 and a\\b.";
  manual.options = {{{"-o", "--output"}, {"FILE", {}, "", true}, "write [this]: \"it's\""},
                    {{"--how"}, {"HOW", {"fast", "slow"}}, "how"},
                    {{"--quiet"}, {}, "quietly"}};
  manual.arguments = {{{}, {"in", {}, "", true}, "what is painted"}};
  manual.commands_take_options = true;
  manual.commands = {{"show",
                      {"display"},
                      "in",
                      "Show it.",
                      {{{"--size"}, {"N"}, "pixels"}},
                      {{{}, {"NAME", {"one", "other"}}, "a name"}}}};
  manual.sections = {{"EXIT STATUS", "0 or 1."}};
  return manual;
}

/// What a shell's command prints.
std::string output_of(const std::string& command) {
  std::FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return "no pipe";
  std::string text;
  std::array<char, 4096> piece{};
  while (const std::size_t size = std::fread(piece.data(), 1, piece.size(), pipe)) {
    text.append(piece.data(), size);
  }
  pclose(pipe);
  return text;
}

TEST(ManualPage, Roff) {
  EXPECT_EQ(man_page(some_manual()),
            ".TH PAINT 1 \"\" \"gamer 1.2\" \"User Commands\"\n.nh\n.ad l\n"
            ".SH NAME\npaint \\- paint things\n"
            ".SH SYNOPSIS\n\\fBpaint\\fR [options] in\n.br\n"
            ".SH DESCRIPTION\n.PP\nIt isn\\(aqt \\fB\\-\\-fast\\fR.\n.PP\n"
            ".RS 4\n.nf\npaint \\(aqx\\(aq\n.fi\n.RE\n"
            "\\&.Dots and \\[u00C5] and a\\eb.\n"
            ".TP\n\\fIin\\fR\nwhat is painted\n"
            ".SH OPTIONS\n"
            ".TP\n\\fB\\-o\\fR, \\fB\\-\\-output\\fR \\fIFILE\\fR\nwrite [this]: \"it\\(aqs\"\n"
            ".TP\n\\fB\\-\\-how\\fR \\fIHOW\\fR\nhow\n"
            ".TP\n\\fB\\-\\-quiet\\fR\nquietly\n"
            ".SH COMMANDS\n"
            ".SS \"show\"\n\\fBpaint show\\fR in\n.br\nalso \\fBpaint display\\fR\n.PP\nShow it.\n"
            ".TP\n\\fINAME\\fR\na name\n"
            ".TP\n\\fB\\-\\-size\\fR \\fIN\\fR\npixels\n"
            ".SH \"EXIT STATUS\"\n.PP\n0 or 1.\n");
}

/// The words that bash offers in place of the last word, when a shell reads these words.
std::string offered(const std::string& words) {
  return output_of("exec bash <<'SCRIPT'\n" + bash_completion(some_manual()) +
                   "COMP_WORDS=(paint " + words +
                   ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\ncd /proc/self/task\n"
                   "_paint paint\necho -n \"${COMPREPLY[*]}\"\nSCRIPT\n");
}

TEST(Completion, Bash) {
  EXPECT_EQ(offered("--h"), "--how");
  EXPECT_EQ(offered("--how f"), "fast");
  EXPECT_EQ(offered("--how = s"), "slow");
  EXPECT_EQ(offered("--how ="), "fast slow");
  EXPECT_EQ(offered("sho"), "show");
  EXPECT_EQ(offered("disp"), "display");
  EXPECT_EQ(offered("show o"), "one other");
  EXPECT_EQ(offered("display --quiet ot"), "other");
  EXPECT_EQ(offered("show --"), "--size --output --how --quiet");
  EXPECT_EQ(offered("show --how s"), "slow");
  EXPECT_EQ(offered("show --size 3"), "");
  EXPECT_EQ(offered("--output x"), "");
}

// A name in a list may be that of a file, and is never run as a command.
TEST(Completion, BashRunsNoNames) {
  Manual manual = some_manual();
  manual.commands.front().arguments.front().value = {"NAME", {}, "--names"};
  const std::string script = "exec bash <<'SCRIPT'\n" + bash_completion(manual) +
                             "paint() { printf '%s text\\n' m51 'm$(echo>&2 ran)' m101 x 'm;b'; }\n"
                             "COMP_WORDS=(paint show m)\nCOMP_CWORD=2\n"
                             "_paint paint\necho -n \"${COMPREPLY[*]}\"\nSCRIPT\n";
  EXPECT_EQ(output_of(script + " 2>&1"), "m51 m101");
}

TEST(Completion, Zsh) {
  const std::string script = zsh_completion(some_manual());
  EXPECT_TRUE(script.starts_with("#compdef paint\n"));
  EXPECT_NE(script.find("'*-o[write \\[this\\]\\: \"it'\\''s\"]:FILE:_files'"), std::string::npos)
      << script;
  EXPECT_NE(script.find("'*--how[how]:HOW:(fast slow)'"), std::string::npos);
  EXPECT_NE(script.find("'*:NAME:(one other)'"), std::string::npos);
}

TEST(Manual, UnknownFormats) {
  EXPECT_EQ(manual_text(some_manual(), "man"), man_page(some_manual()));
  EXPECT_EQ(error_text([] { manual_text(some_manual(), "info"); }),
            "paint: --print-manual: unknown format 'info'; known are man, bash, zsh");
}

}  // namespace
}  // namespace gamer::manual_test
