#include "gamer/processing/gutil_manual.h"

#include <fmt/format.h>

#include "gamer/core/version.h"
#include "gamer/processing/operation.h"

namespace gamer {
namespace {

constexpr const char* description =
    "gutil works on FITS images: it adds noise, convolves, turns, scales, combines and measures "
    "them. Options of an operation precede or follow its files. `-` is standard input or output; "
    "`a.fits[1]` or `a.fits[SCI][10:90,10:90]` is one HDU or a part of it.";

ManualOption option_of(const Parameter& parameter) {
  ManualOption option;
  option.names = {parameter.name};
  if (parameter.name == "--threads") option.names.insert(option.names.begin(), "-j");
  option.description = parameter.description;
  if (parameter.type == ParameterType::boolean) return option;
  option.value.name = parameter.type_text();
  option.value.words = parameter.choices;
  option.value.is_file =
      parameter.type == ParameterType::text || parameter.type == ParameterType::texts;
  const std::string value = parameter.default_text();
  if (value == "required") option.description += " (required)";
  if (value != "required" && value != "none") {
    option.description += fmt::format(" (default: {})", value);
  }
  return option;
}

ManualCommand command_of(const Operation& operation) {
  ManualCommand command;
  command.name = operation.name;
  command.aliases = operation.aliases;
  command.synopsis = "[options] " + files_text(operation);
  command.description = fmt::format("{}.\n\n{}\n\n    gutil {}", operation.summary,
                                    operation.description, operation.example);
  for (const Parameter& parameter : operation_options(operation)) {
    command.options.push_back(option_of(parameter));
  }
  return command;
}

}  // namespace

Manual gutil_manual() {
  Manual manual;
  manual.program = "gutil";
  manual.version = version();
  manual.summary = "operations on FITS images";
  manual.synopses = {"operation [options] in.fits ... out.fits", "operation --help"};
  manual.description = description;
  manual.options = {{{"-h", "--help"}, {}, "list the operations, or the options of one"},
                    {{"--version"}, {}, "print the version"}};
  for (const Operation& operation : operations()) manual.commands.push_back(command_of(operation));
  manual.sections = {{"EXIT STATUS",
                      "0 is done, 1 failed while running, and 2 wrong input. `gutil compare` ends "
                      "with 1 where images differ."},
                     {"ENVIRONMENT", "`GAMER_DATA` is a folder with instruments/."},
                     {"SEE ALSO", "`gamer`(1)"}};
  return manual;
}

}  // namespace gamer
