#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/parameter.h"

namespace gamer {

/// What a user asked of an operation.
struct OperationCall {
  std::string operation;            ///< its name
  std::vector<std::string> inputs;  ///< names as FitsInput takes them
  std::string output;               ///< empty where the operation writes no file
  ParameterSet parameters;
  std::string history;  ///< the HISTORY card: operation, given parameters, version
  int bitpix = 0;       ///< of a FITS output, -32 or -64; 0: as the input
  bool overwrite = false;
  int threads = 1;
  /// Tables and numbers for people go here, not to a file.
  std::function<void(const std::string& text)> print;
};

/// One operation of gutil, declared once: the command line, its help, the reference in docs/ and
/// the tests that run all of them read this.
struct Operation {
  enum class Result {
    fits,     ///< in.fits ... out.fits
    picture,  ///< in.fits ... out.png
    text      ///< in.fits ...; printed
  };

  std::string name;
  std::vector<std::string> aliases;
  std::string group;        ///< heading in lists
  std::string summary;      ///< one line
  std::string description;  ///< formulae, units, what happens to the header
  int least_inputs = 1;
  int most_inputs = 1;  ///< no limit where 0
  Result result = Result::fits;
  ParameterTable parameters;
  std::string example;  ///< options and files; the tests run it
  /// Returns 0, or 1 where the answer is "no" (compare).
  std::function<int(const OperationCall&)> run;
};

/// All of them, in the order of lists.
std::span<const Operation> operations();

/// By name or alias. Throws InputError with near names.
const Operation& find_operation(std::string_view name);

/// A parameter's name as users type it: "axis_ratio" is "--axis-ratio".
std::string option_name(std::string_view parameter);

/// Reads a command line: options, then files. Throws InputError: unknown or repeated option, a
/// value that is missing, of wrong type or out of range, too few or too many files.
OperationCall parse_call(const Operation& operation, std::span<const std::string> arguments);

/// What `gutil --help` and `gutil <operation> --help` print, and docs/gutil.md's tables.
std::string operations_help();
std::string operation_help(const Operation& operation);
std::string operations_markdown();

}  // namespace gamer
