#include <algorithm>
#include <ranges>
#include <string_view>

#include "core/message.h"
#include "gamer/core/manual.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

/// The text in the single quotes of a shell.
std::string quoted(std::string_view text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

/// All names of the options, separated by spaces.
std::string joined_names(const std::vector<ManualOption>& options) {
  const auto names = options | std::views::transform(&ManualOption::names) | std::views::join;
  return fmt::format("{}", fmt::join(names, " "));
}

std::vector<ManualOption> options_of(const Manual& manual, const ManualCommand& command) {
  std::vector<ManualOption> options = command.options;
  if (!manual.commands_take_options) return options;
  for (const ManualOption& option : manual.options) {
    const bool is_there = std::ranges::any_of(
        options, [&](const ManualOption& known) { return known.names == option.names; });
    if (!is_there) options.push_back(option);
  }
  return options;
}

/// bash commands that say what completes a value.
std::string bash_values(const ManualValue& value) {
  if (!value.list.empty()) return fmt::format("list={}", value.list);
  if (!value.words.empty())
    return fmt::format("words={}", quoted(fmt::format("{}", fmt::join(value.words, " "))));
  return value.is_file ? "return" : "compopt +o default 2>/dev/null; return 0";
}

/// Branches of bash's `case` over "<command>:<word before>", one for each option with a value.
std::string bash_branches(const std::string& command, const std::vector<ManualOption>& options) {
  std::string text;
  for (const ManualOption& option : options) {
    if (option.value.name.empty()) continue;
    std::string pattern;
    for (const std::string& name : option.names) {
      pattern += fmt::format("{}{}:{}", pattern.empty() ? "" : " | ", command, name);
    }
    text += fmt::format("    {}) {} ;;\n", pattern, bash_values(option.value));
  }
  return text;
}

std::string command_names(const Manual& manual) {
  std::string names;
  for (const ManualCommand& command : manual.commands) {
    names += (names.empty() ? "" : " ") + command.name;
    for (const std::string& alias : command.aliases) names += " " + alias;
  }
  return names;
}

/// bash code that sets `command` to the name of the command in `word`.
std::string command_search(const Manual& manual) {
  std::string text = "    case $word in\n";
  for (const ManualCommand& command : manual.commands) {
    std::string pattern = command.name;
    for (const std::string& alias : command.aliases) pattern += " | " + alias;
    text += fmt::format("      {}) command={} && break ;;\n", pattern, command.name);
  }
  return text + "    esac\n";
}

/// Text in brackets or between colons of a specification for _arguments.
std::string zsh_text(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

std::string zsh_action(const Manual& manual, const ManualValue& value) {
  if (!value.list.empty()) return fmt::format("{{_{}_names {}}}", manual.program, value.list);
  if (!value.words.empty()) {
    const std::string words = fmt::format("{}", fmt::join(value.words, " "));
    return words.ends_with('=') ? "compadd -S \"\" -- " + words : "(" + words + ")";
  }
  return value.is_file ? "_files" : " ";
}

std::string zsh_options(const Manual& manual, const std::vector<ManualOption>& options) {
  std::string text;
  for (const ManualOption& option : options) {
    for (const std::string& name : option.names) {
      std::string spec = fmt::format("*{}[{}]", name, zsh_text(option.description));
      if (!option.value.name.empty()) {
        spec +=
            fmt::format(":{}:{}", zsh_text(option.value.name), zsh_action(manual, option.value));
      }
      text += fmt::format(" \\\n        {}", quoted(spec));
    }
  }
  return text;
}

/// The beginning of the bash function, which finds the command and the word before.
std::string bash_start(const Manual& manual) {
  return fmt::format(
      "# Completes the words of {0} in bash; made by {0} --print-manual bash.\n"
      "_{0}() {{\n"
      "  local cur=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}}\n"
      "  local command= word words= list= with_files= offered\n"
      "  COMPREPLY=()\n"
      "  # bash makes \"=\" a word of its own.\n"
      "  if [[ $cur == = ]]; then\n"
      "    cur=\n"
      "  elif [[ $before == = ]]; then\n"
      "    before=${{COMP_WORDS[COMP_CWORD - 2]}}\n"
      "  fi\n"
      "  for word in \"${{COMP_WORDS[@]:1:COMP_CWORD - 1}}\"; do\n{1}  done\n"
      "  case $command:$before in\n",
      manual.program, command_search(manual));
}

/// The end of the bash function, behind the branches of its `case`. It avoids compgen -W, which
/// would run commands within a name.
std::string bash_end(const std::string& program) {
  return fmt::format(
      "    esac\n"
      "  fi\n"
      "  if [[ -n $list ]]; then\n"
      "    words=$(\"$1\" \"$list\" 2>/dev/null | cut -d' ' -f1 | grep -E '^[[:alnum:]._+-]+$')\n"
      "  fi\n"
      "  read -r -d '' -a offered <<<\"$words\"\n"
      "  [[ -n $with_files ]] && mapfile -t COMPREPLY < <(compgen -f -- \"$cur\")\n"
      "  for word in \"${{offered[@]}}\"; do\n"
      "    [[ $word == \"$cur\"* ]] && COMPREPLY+=(\"$word\")\n"
      "  done\n"
      "  [[ -n $with_files ]] && compopt -o filenames 2>/dev/null\n"
      "  [[ ${{COMPREPLY[*]}} == *= ]] && compopt -o nospace 2>/dev/null\n"
      "  return 0\n"
      "}}\n"
      "complete -o default -F _{0} {0}\n",
      program);
}

}  // namespace

std::string bash_completion(const Manual& manual) {
  std::string text = bash_start(manual);
  for (const ManualCommand& command : manual.commands) {
    text += bash_branches(command.name, command.options);
  }
  text += bash_branches(manual.commands_take_options ? "*" : "", manual.options);
  text +=
      "  esac\n"
      "  if [[ -z $words$list ]]; then\n"
      "    case $command:$cur in\n";
  for (const ManualCommand& command : manual.commands) {
    text += fmt::format("      {}:-*) words={} ;;\n", command.name,
                        quoted(joined_names(options_of(manual, command))));
    if (!command.arguments.empty()) {
      text += fmt::format("      {}:*) {} ;;\n", command.name,
                          bash_values(command.arguments.front().value));
    }
  }
  text += fmt::format("      :-*) words={} ;;\n", quoted(joined_names(manual.options)));
  text += fmt::format("      :*) words={}{} ;;\n", quoted(command_names(manual)),
                      manual.arguments.empty() ? "" : " with_files=yes");
  return text + bash_end(manual.program);
}

std::string zsh_completion(const Manual& manual) {
  const std::string& program = manual.program;
  std::string text = fmt::format(
      "#compdef {0}\n"
      "# Completes the words of {0} in zsh; made by {0} --print-manual zsh.\n"
      "_{0}_names() {{\n"
      "  local -a names\n"
      "  names=(${{(f)\"$(_call_program names $words[1] $1 2>/dev/null)\"}})\n"
      "  compadd -- ${{names%% *}}\n"
      "}}\n"
      "_{0}_first() {{\n"
      "  compadd -- {1}\n{2}}}\n"
      "_{0}() {{\n"
      "  local command= word\n"
      "  for word in \"${{(@)words[2,CURRENT - 1]}}\"; do\n{3}  done\n"
      "  case $command in\n",
      program, command_names(manual), manual.arguments.empty() ? "" : "  _files\n",
      command_search(manual));
  for (const ManualCommand& command : manual.commands) {
    const ManualValue argument = command.arguments.empty() ? ManualValue{"file", {}, "", true}
                                                           : command.arguments.front().value;
    text += fmt::format(
        "    {})\n      _arguments '1: : '{}{} ;;\n", command.name,
        zsh_options(manual, options_of(manual, command)),
        fmt::format(" \\\n        {}", quoted(fmt::format("*:{}:{}", zsh_text(argument.name),
                                                          zsh_action(manual, argument)))));
  }
  text += fmt::format(
      "    *)\n      _arguments{} \\\n        '1: :_{}_first' '*:file:_files' ;;\n  esac\n}}\n",
      zsh_options(manual, manual.options), program);
  return text + fmt::format("_{} \"$@\"\n", program);
}

std::string manual_text(const Manual& manual, const std::string& format) {
  if (format == "man") return man_page(manual);
  if (format == "bash") return bash_completion(manual);
  if (format == "zsh") return zsh_completion(manual);
  throw input_error("{}: --print-manual: unknown format {}; known are man, bash, zsh",
                    manual.program, in_quotes(format));
}

}  // namespace gamer
