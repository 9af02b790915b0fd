#include "gamer/processing/operation.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "core/message.h"
#include "core/text.h"
#include "gamer/core/config.h"
#include "gamer/core/near.h"
#include "gamer/core/version.h"
#include "processing/operation_groups.h"

namespace gamer {
namespace {

constexpr int most_threads = 4096;

/// Options of every operation; `bitpix` only for FITS output.
ParameterTable common_parameters(Operation::Result result) {
  ParameterTable table = {
      Parameter::boolean("overwrite", false, "replace an existing output"),
      Parameter::integer("threads", "", Interval::closed(1, most_threads), std::nullopt,
                         "threads (default: all cores); also -j")};
  if (result == Operation::Result::fits) {
    table.push_back(
        Parameter::choice("bitpix", {"-32", "-64"}, std::nullopt,
                          "FITS data type of the output, in bits (default: the input's; of "
                          "integers, the floating-point type that holds them)"));
  }
  return table;
}

/// The name with dashes: "axis_ratio" becomes "axis-ratio".
std::string dashed(std::string_view parameter) {
  std::string name(parameter);
  std::ranges::replace(name, '_', '-');
  return name;
}

std::string context_of(const Operation& operation) {
  return fmt::format("gutil {}: ", operation.name);
}

ConfigNode node(ConfigNode::Data data) {
  ConfigNode result;
  result.data = std::move(data);
  return result;
}

/// A number if the text is one, else the text; the declaration then reports what is wrong.
ConfigNode number_node(const std::string& text) {
  if (const auto whole = number_of<std::int64_t>(without_plus(text))) return node(*whole);
  if (const auto real = number_of<double>(without_plus(text))) return node(*real);
  return node(text);
}

/// The words after an option, as a node of the parameter's type.
ConfigNode value_node(const Parameter& parameter, const std::vector<std::string>& given) {
  if (parameter.type == ParameterType::boolean) return node(true);
  const std::string& text = given.front();
  const auto list = [&text](auto element) {
    ConfigNode::Array elements;
    for (const std::string& part : split_at_commas(text)) elements.push_back(element(part));
    return node(std::move(elements));
  };
  switch (parameter.type) {
    case ParameterType::text:
    case ParameterType::choice: return node(text);
    case ParameterType::texts: {
      ConfigNode::Array elements;
      for (const std::string& element : given) elements.push_back(node(element));
      return node(std::move(elements));
    }
    case ParameterType::vector2:
    case ParameterType::vector3:
    case ParameterType::numbers: return list(number_node);
    case ParameterType::size2:
      return text.find(',') == std::string::npos ? number_node(text) : list(number_node);
    default: return number_node(text);
  }
}

/// The table with names as users type them.
ParameterTable option_table(const ParameterTable& table) {
  ParameterTable options = table;
  for (Parameter& parameter : options) parameter.name = dashed(parameter.name);
  return options;
}

ParameterTable all_parameters(const Operation& operation) {
  return operation.parameters + common_parameters(operation.result);
}

/// Values of options by parameter name; flags have none. A list of texts may be given by repeated
/// options.
struct CommandLine {
  std::map<std::string, std::vector<std::string>> values;
  std::vector<std::string> files;
};

CommandLine read_command_line(const Operation& operation, const ParameterTable& table,
                              std::span<const std::string> arguments) {
  CLI::App app;
  app.set_help_flag();
  app.allow_extras();
  std::map<std::string, std::vector<std::string>> given;
  std::map<std::string, std::int64_t> flags;
  std::vector<std::string> names;
  for (const Parameter& parameter : table) {
    names.push_back(option_name(parameter.name));
    // -j is the usual short name.
    const std::string name = parameter.name == "threads" ? "-j,--threads" : names.back();
    if (parameter.type == ParameterType::boolean) {
      app.add_flag(name, flags[parameter.name]);
    } else {
      app.add_option(name, given[parameter.name])->allow_extra_args(false);
    }
  }
  CommandLine line;
  const std::string context = context_of(operation);
  // CLI11 takes arguments from the end.
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    app.parse(reversed);
  } catch (const CLI::ParseError& error) {
    throw input_error("{}{} (gutil {} --help lists the options)", context, error.what(),
                      operation.name);
  }
  for (const std::string& extra : app.remaining()) {
    if (extra.size() > 1 && extra.starts_with('-')) {
      const std::string near = did_you_mean(extra, names);
      throw input_error("{}unknown option {}{}", context, in_quotes(extra),
                        near.empty()
                            ? fmt::format(" (gutil {} --help lists the options)", operation.name)
                            : near);
    }
    line.files.push_back(extra);
  }
  for (const auto& [name, values] : given) {
    const auto parameter = std::ranges::find(table, name, &Parameter::name);
    if (values.size() > 1 && parameter->type != ParameterType::texts) {
      throw input_error("{}{} is given {} times", context, option_name(name), values.size());
    }
    if (!values.empty()) line.values[name] = values;
  }
  for (const auto& [name, count] : flags) {
    if (count > 0) line.values[name] = {};
  }
  return line;
}

ConfigNode config_of(const ParameterTable& table, const CommandLine& line, bool as_options) {
  ConfigNode config;
  for (const Parameter& parameter : table) {
    const auto found = line.values.find(parameter.name);
    if (found == line.values.end()) continue;
    const std::string key = as_options ? dashed(parameter.name) : parameter.name;
    config.table().emplace_back(key, value_node(parameter, found->second));
  }
  return config;
}

void take_files(const Operation& operation, std::vector<std::string> files, OperationCall& call) {
  const std::string usage =
      fmt::format("gutil {} [options] {}", operation.name, files_text(operation));
  if (operation.result != Operation::Result::text) {
    if (files.empty()) throw input_error("{}needs an output: {}", context_of(operation), usage);
    call.output = files.back();
    files.pop_back();
  }
  const auto count = static_cast<int>(files.size());
  const bool is_limited = operation.most_inputs != 0 || operation.least_inputs == 0;
  const bool too_many = is_limited && count > operation.most_inputs;
  if (count < operation.least_inputs || too_many) {
    throw input_error("{}{} input file{} given: {}", context_of(operation), count,
                      count == 1 ? "" : "s", usage);
  }
  call.inputs = std::move(files);
}

/// The operation's call as typed, always with the seed.
std::string history_of(const Operation& operation, const OperationCall& call) {
  std::string text = fmt::format("gutil {}", operation.name);
  for (const Parameter& parameter : operation.parameters) {
    const ParameterValue& value = call.parameters.value(parameter.name);
    const bool is_named = call.parameters.is_given(parameter.name) || parameter.name == "seed";
    if (!is_named) continue;
    const std::string name = " " + option_name(parameter.name);
    if (std::holds_alternative<bool>(value)) {
      text += name;
    } else if (const auto* numbers = std::get_if<std::vector<double>>(&value)) {
      text += fmt::format("{} {}", name, fmt::join(*numbers, ","));
    } else if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) {
      for (const std::string& word : *texts) text += fmt::format("{} {}", name, word);
    } else if (const auto* word = std::get_if<std::string>(&value)) {
      text += fmt::format("{} {}", name, *word);
    } else {
      text += fmt::format("{} {}", name, value_text(value));
    }
  }
  if (call.bitpix != 0) text += fmt::format(" --bitpix {}", call.bitpix);
  for (const std::string& input : call.inputs) text += " " + input;
  return text + fmt::format(" (gamer {})", version());
}

std::string joined_names(const Operation& operation) {
  std::string names = operation.name;
  for (const std::string& alias : operation.aliases) names += fmt::format(" ({})", alias);
  return names;
}

}  // namespace

std::string files_text(const Operation& operation) {
  std::string text;
  if (operation.least_inputs > 0)
    text = operation.most_inputs == 1   ? "in.fits"
           : operation.most_inputs == 2 ? "a.fits b.fits"
                                        : "a.fits b.fits ...";
  if (operation.result != Operation::Result::text) {
    if (!text.empty()) text += ' ';
    text += operation.result == Operation::Result::fits ? "out.fits" : "out.png";
  }
  return text;
}

ParameterTable operation_options(const Operation& operation) {
  ParameterTable table = option_table(all_parameters(operation));
  for (Parameter& parameter : table) parameter.name.insert(0, "--");
  return table;
}

std::string option_name(std::string_view parameter) { return "--" + dashed(parameter); }

std::span<const Operation> operations() {
  static const std::vector<Operation> all = [] {
    std::vector<Operation> list;
    using Group = std::pair<const char*, std::vector<Operation> (*)()>;
    for (const auto& [group, make] : {Group{"Detector", detector_operations},
                                      {"Blur", blur_operations},
                                      {"Geometry", geometry_operations},
                                      {"Brightness and colour", tone_operations},
                                      {"Arithmetic", arithmetic_operations},
                                      {"Measurement", measure_operations},
                                      {"Files and headers", file_operations}}) {
      for (Operation& operation : make()) {
        operation.group = group;
        list.push_back(std::move(operation));
      }
    }
    return list;
  }();
  return all;
}

const Operation& find_operation(std::string_view name) {
  std::vector<std::string> names;
  for (const Operation& operation : operations()) {
    if (operation.name == name ||
        std::ranges::find(operation.aliases, name) != operation.aliases.end()) {
      return operation;
    }
    names.push_back(operation.name);
    names.insert(names.end(), operation.aliases.begin(), operation.aliases.end());
  }
  const std::string near = did_you_mean(name, names);
  throw input_error("gutil: unknown operation {}{}", in_quotes(name),
                    near.empty() ? " (gutil --help lists them)" : near);
}

OperationCall parse_call(const Operation& operation, std::span<const std::string> arguments) {
  const ParameterTable table = all_parameters(operation);
  const CommandLine line = read_command_line(operation, table, arguments);
  // The values are read twice: with the names that users type, for messages, and with those of the
  // code.
  ParameterTable options = option_table(table);
  for (Parameter& parameter : options) parameter.required = false;
  ParameterSet::read(options, config_of(table, line, true), context_of(operation) + "--", "");
  for (const Parameter& parameter : table) {
    if (!parameter.required || line.values.contains(parameter.name)) continue;
    throw input_error("{}needs {}: {}", context_of(operation), option_name(parameter.name),
                      parameter.description);
  }
  const ParameterSet all = ParameterSet::read(table, config_of(table, line, false), "", "");
  OperationCall call;
  call.operation = operation.name;
  call.overwrite = all.boolean("overwrite");
  const bool writes_fits = operation.result == Operation::Result::fits;
  if (writes_fits && all.has("bitpix")) call.bitpix = *number_of<int>(all.text("bitpix"));
  call.threads = all.has("threads") ? static_cast<int>(all.integer("threads")) : 0;
  call.parameters = all;
  take_files(operation, line.files, call);
  call.history = history_of(operation, call);
  return call;
}

std::string operations_help() {
  std::string text =
      "Operations on FITS images.\n\n"
      "  gutil <operation> [options] in.fits ... out.fits\n"
      "  gutil <operation> --help\n\n"
      "'-' is standard input or output; a.fits[1] or a.fits[SCI][10:90,10:90] is one HDU or a "
      "part\n"
      "of it.\n";
  std::size_t width = 0;
  for (const Operation& operation : operations()) {
    width = std::max(width, joined_names(operation).size());
  }
  std::string group;
  for (const Operation& operation : operations()) {
    if (operation.group != group) {
      group = operation.group;
      text += fmt::format("\n{}:\n", group);
    }
    text += fmt::format("  {:<{}}  {}\n", joined_names(operation), width, operation.summary);
  }
  return text;
}

std::string operation_help(const Operation& operation) {
  const ParameterTable table = operation_options(operation);
  return fmt::format("gutil {} [options] {}\n\n{}\n\n{}\n\nExample: gutil {}\n\n{}", operation.name,
                     files_text(operation), operation.summary, operation.description,
                     operation.example, terminal_table(table));
}

std::string operations_markdown() {
  std::string text;
  for (const Operation& operation : operations()) {
    ParameterTable table = option_table(operation.parameters);
    for (Parameter& parameter : table) parameter.name.insert(0, "--");
    text += fmt::format("\n## {}\n\n{}.\n\n{}\n\n    gutil {}\n", joined_names(operation),
                        operation.summary, operation.description, operation.example);
    if (!table.empty()) text += "\n" + markdown_table(table);
  }
  return text;
}

}  // namespace gamer
