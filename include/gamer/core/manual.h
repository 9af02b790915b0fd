#pragma once

#include <string>
#include <utility>
#include <vector>

namespace gamer {

/// The value of an option, or an argument.
struct ManualValue {
  std::string name;                     ///< "PATH"; empty for options without a value
  std::vector<std::string> words = {};  ///< known values; "image.size=" begins one
  std::string list = {};                ///< an option of the program that lists known values
  bool is_file = false;
};

struct ManualOption {
  std::vector<std::string> names;  ///< "-o", "--output"; none for an argument
  ManualValue value;
  std::string description;
};

/// A command of the program: the word after the program's name.
struct ManualCommand {
  std::string name;
  std::vector<std::string> aliases;
  std::string synopsis;     ///< words behind the name
  std::string description;  ///< paragraphs with an empty line between; code is indented
  std::vector<ManualOption> options;
  std::vector<ManualOption> arguments;
};

/// A program's command line, from which manual pages and completions are made.
struct Manual {
  std::string program;
  std::string version;
  std::string summary;                ///< without a final period
  std::vector<std::string> synopses;  ///< words behind the program's name
  std::string description;            ///< paragraphs
  std::vector<ManualOption> options;  ///< of the program
  std::vector<ManualOption> arguments;
  bool commands_take_options = false;  ///< whether commands also take `options`
  std::vector<ManualCommand> commands;
  std::vector<std::pair<std::string, std::string>> sections;  ///< further headings and paragraphs
};

/// The manual page, in roff with the macros of man(7).
std::string man_page(const Manual& manual);
/// Scripts that complete the program's words in these shells.
std::string bash_completion(const Manual& manual);
std::string zsh_completion(const Manual& manual);

/// One of these texts, by "man", "bash" or "zsh". Throws InputError for another format.
std::string manual_text(const Manual& manual, const std::string& format);

}  // namespace gamer
