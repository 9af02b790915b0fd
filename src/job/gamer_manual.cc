#include "gamer/job/gamer_manual.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>

#include "gamer/core/version.h"
#include "gamer/job/listing.h"
#include "gamer/scene/render_parameters.h"
#include "job/cli_options.h"

namespace gamer {
namespace {

constexpr const char* program_description =
    "gamer renders a scene of synthetic galaxies to a FITS image or a picture. A parameter file "
    "says how, and a scene list or a catalogue says what, one galaxy in a row. Under mpirun all "
    "ranks share the rows of the image, which is the same for any number of ranks and threads.\n\n"
    "An output is complete or not there at all. A job that has run for ten seconds keeps its "
    "finished rows in a journal beside the output, OUTPUT.journal; after an interruption "
    "`--resume` goes on with it.";

/// "spectrum.bands=" of every key.
std::vector<std::string> keys() {
  std::vector<std::string> words;
  for (const ParameterSection& section : render_parameter_sections()) {
    for (const Parameter& parameter : section.table) {
      words.push_back(fmt::format("{}.{}=", section.name, parameter.name));
    }
  }
  return words;
}

/// The placeholder of an option's value, with the known values.
ManualValue value_of(const CLI::Option& option) {
  std::string name = option.get_type_name();
  ManualValue value;
  if (const std::size_t brace = name.find(":{"); brace != std::string::npos) {
    value.words = CLI::detail::split(name.substr(brace + 2, name.size() - brace - 3), ',');
    name = fmt::format("{}", fmt::join(value.words, "|"));
  }
  value.name = name.substr(0, name.find(':'));
  value.is_file =
      name == "FILE" || name == "PATH" || name == "IMAGE" || name == "JOURNAL" || name == "SCENE";
  if (name == "GALAXY") value.list = "--list-galaxies";
  if (name == "[KIND]") value.words = parameter_kinds();
  if (name == "KEY=VALUE") value.words = keys();
  return value;
}

ManualOption option_of(const CLI::Option& option) {
  ManualOption entry;
  for (const std::string& name : option.get_snames()) entry.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) entry.names.push_back("--" + name);
  if (option.get_type_size() != 0) entry.value = value_of(option);
  if (option.get_positional()) entry.value.name = option.get_name(true);
  entry.description = option.get_description();
  if (!option.get_default_str().empty()) {
    entry.description += fmt::format(" (default: {})", option.get_default_str());
  }
  return entry;
}

}  // namespace

void add_cli_options(const CLI::App& app, std::vector<ManualOption>& options,
                     std::vector<ManualOption>& arguments) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    (option->get_positional() ? arguments : options).push_back(option_of(*option));
  }
}

Manual gamer_manual(const CLI::App& app) {
  Manual manual;
  manual.program = app.get_name();
  manual.version = version();
  manual.summary = "render synthetic galaxies";
  manual.synopses = {"[options] render.par scene.lst", "[options] --from-header image"};
  manual.description = program_description;
  add_cli_options(app, manual.options, manual.arguments);
  manual.commands_take_options = true;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    ManualCommand entry;
    entry.name = command->get_name();
    entry.description = command->get_description();
    add_cli_options(*command, entry.options, entry.arguments);
    for (const ManualOption& argument : entry.arguments) {
      entry.synopsis += (entry.synopsis.empty() ? "" : " ") + argument.value.name;
    }
    manual.synopses.push_back(fmt::format("{} [options] {}", entry.name, entry.synopsis));
    manual.commands.push_back(std::move(entry));
  }
  manual.sections = {
      {"EXIT STATUS",
       "0 is done, 1 failed while running, and 2 wrong input. A program that was stopped by a "
       "signal ends by it: shells see 128 and its number."},
      {"ENVIRONMENT",
       "`GAMER_DATA` is a folder with galaxies/, seds/, bandpasses/ and instruments/. "
       "`GAMER_CACHE` is the folder that keeps measurements of galaxies between jobs, or `off`; by "
       "default it is gamer/ in `XDG_CACHE_HOME` or ~/.cache. "
       "`SOURCE_DATE_EPOCH` gives the DATE of files, in seconds since 1970."},
      {"EXAMPLES",
       "    gamer look ngc4321\n    gamer render.par scene.lst -o field.fits --truth\n"
       "    mpirun -n 64 gamer --resume render.par scene.lst -o field.fits\n"
       "    gamer --status field.fits.journal"},
      {"SEE ALSO", "`gutil`(1), `mpirun`(1)"}};
  return manual;
}

}  // namespace gamer
