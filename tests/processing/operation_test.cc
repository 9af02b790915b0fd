#include "gamer/processing/operation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "gamer/core/error.h"

namespace gamer::operation_test {
namespace {

std::string message_of(const std::string& operation, const std::vector<std::string>& arguments) {
  try {
    parse_call(find_operation(operation), arguments);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Operation, EveryDeclarationIsWhole) {
  std::set<std::string> names;
  for (const Operation& operation : operations()) {
    EXPECT_TRUE(names.insert(operation.name).second) << operation.name;
    for (const std::string& alias : operation.aliases) {
      EXPECT_TRUE(names.insert(alias).second) << alias;
      EXPECT_EQ(&find_operation(alias), &operation);
    }
    EXPECT_FALSE(operation.group.empty()) << operation.name;
    EXPECT_FALSE(operation.summary.empty()) << operation.name;
    EXPECT_FALSE(operation.description.empty()) << operation.name;
    EXPECT_TRUE(operation.example.starts_with(operation.name + " ")) << operation.example;
    EXPECT_TRUE(operation.run) << operation.name;
    for (const Parameter& parameter : operation.parameters) {
      EXPECT_FALSE(parameter.description.empty()) << operation.name << " " << parameter.name;
      if (parameter.required) continue;
      EXPECT_NO_THROW(
          ParameterSet(operation.parameters).set(parameter.name, parameter.default_value))
          << operation.name << " " << parameter.name;
    }
    EXPECT_NE(operations_help().find("\n  " + operation.name), std::string::npos);
    EXPECT_NE(operations_markdown().find("\n## " + operation.name), std::string::npos);
  }
}

/// For every number with a bounded interval, a value beyond it gives an error that says so.
TEST(Operation, EveryIntervalIsKept) {
  for (const Operation& operation : operations()) {
    for (const Parameter& parameter : operation.parameters) {
      const bool is_number =
          parameter.type == ParameterType::number || parameter.type == ParameterType::numbers;
      if (!is_number || !std::isfinite(parameter.interval.low)) continue;
      std::string option = "--" + parameter.name;
      for (char& c : option) c = c == '_' ? '-' : c;
      const std::string below = std::to_string(parameter.interval.low - 1);
      const std::string message = message_of(operation.name, {option, below, "a.fits", "b.fits"});
      EXPECT_NE(message.find("is outside"), std::string::npos)
          << operation.name << option << message;
      EXPECT_TRUE(message.starts_with("gutil " + operation.name + ": " + option)) << message;
    }
  }
}

TEST(Operation, ReadsACommandLine) {
  const std::vector<std::string> arguments = {"in.fits",     "--factor", "-3,1e2", "-j",      "2",
                                              "--overwrite", "--bitpix", "-64",    "out.fits"};
  const OperationCall call = parse_call(find_operation("scale"), arguments);
  EXPECT_EQ(call.operation, "scale");
  EXPECT_EQ(call.inputs, std::vector<std::string>{"in.fits"});
  EXPECT_EQ(call.output, "out.fits");
  EXPECT_EQ(call.threads, 2);
  EXPECT_EQ(call.bitpix, -64);
  EXPECT_TRUE(call.overwrite);
  EXPECT_EQ(call.parameters.numbers("factor"), (std::vector<double>{-3, 100}));
  EXPECT_TRUE(call.history.starts_with("gutil scale --factor -3,100 --bitpix -64 in.fits (gamer "))
      << call.history;
}

TEST(Operation, WrongCommandLines) {
  EXPECT_EQ(message_of("scal", {}), "gutil: unknown operation 'scal'; did you mean 'scale'?");
  EXPECT_EQ(message_of("scale", {"--fator", "2", "a.fits", "b.fits"}),
            "gutil scale: unknown option '--fator'; did you mean '--factor'?");
  EXPECT_EQ(message_of("scale", {"--factor", "x", "a.fits", "b.fits"}),
            "gutil scale: --factor[0] must be a number, not a string");
  EXPECT_EQ(message_of("scale", {"--factor", "1", "--factor", "2", "a.fits", "b.fits"}),
            "gutil scale: --factor is given 2 times");
  EXPECT_EQ(message_of("rotate", {"a.fits", "b.fits"}),
            "gutil rotate: needs --angle: angle, counter-clockwise");
  EXPECT_EQ(message_of("add", {"a.fits", "b.fits"}),
            "gutil add: 1 input file given: gutil add [options] a.fits b.fits ... out.fits");
  EXPECT_NE(message_of("scale", {"--factor", "nan", "a.fits", "b.fits"}), "");
  EXPECT_NE(message_of("scale", {"--threads", "0", "a.fits", "b.fits"}), "");
}

}  // namespace
}  // namespace gamer::operation_test
