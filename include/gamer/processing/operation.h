#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/parameter.h"

namespace gamer {

/// A user's call of an operation.
struct OperationCall {
  std::string operation;            ///< its name
  std::vector<std::string> inputs;  ///< names that FitsInput accepts
  std::string output;               ///< empty where the operation writes no file
  ParameterSet parameters;
  std::string history;  ///< the HISTORY card: operation, given parameters, version
  int bitpix = 0;       ///< BITPIX of a FITS output, -32 or -64; 0: that of the input
  bool overwrite = false;
  int threads = 1;
  /// Prints tables and numbers for people; output files are written without it.
  std::function<void(const std::string& text)> print;
};

/// The declaration of one operation of gutil. The command line, its help, the reference in docs/
/// and the tests that run every operation read it.
struct Operation {
  enum class Result {
    fits,     ///< in.fits ... out.fits
    picture,  ///< in.fits ... out.png
    text      ///< in.fits ...; printed
  };

  std::string name;
  std::vector<std::string> aliases = {};
  std::string group = {};   ///< heading in lists
  std::string summary;      ///< one line
  std::string description;  ///< formulae, units, what happens to the header
  int least_inputs = 1;
  int most_inputs = 1;  ///< 0: no limit
  Result result = Result::fits;
  ParameterTable parameters = {};
  std::string example;  ///< options and files; the tests run it
  /// Runs the operation. Returns 0, or 1 where the answer is "no" (compare).
  std::function<int(const OperationCall&)> run;
};

/// All operations, in the order of lists.
std::span<const Operation> operations();

/// Finds an operation by name or alias. Throws InputError for an unknown name. The message proposes
/// similar names.
const Operation& find_operation(std::string_view name);

/// A parameter's name as users type it: "axis_ratio" is "--axis-ratio".
std::string option_name(std::string_view parameter);

/// All options of an operation, with their names as users type them. They include the options that
/// all operations have.
ParameterTable operation_options(const Operation& operation);

/// The files of a call: "in.fits out.fits".
std::string files_text(const Operation& operation);

/// Reads a command line: options, then files. Throws InputError for unknown and repeated options,
/// and for a wrong number of files. Other errors are values that are missing, of a wrong type or
/// out of range.
OperationCall parse_call(const Operation& operation, std::span<const std::string> arguments);

/// Texts of `gutil --help`, of `gutil <operation> --help`, and of the tables in docs/gutil.md.
std::string operations_help();
std::string operation_help(const Operation& operation);
std::string operations_markdown();

}  // namespace gamer
