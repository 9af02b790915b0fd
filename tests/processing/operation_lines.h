#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/data_table.h"
#include "gamer/processing/operation.h"
#include "image/image_test_util.h"

namespace gamer {

/// Runs operations given as lines of words, and reads their tables. Files are in a temporary
/// folder.
class OperationLines : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }

  /// Runs a line such as "stats --clip 3 a.fits", where files are in the folder.
  int run(const std::string& line) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    std::vector<std::string> arguments;
    for (std::string word; words >> word;) {
      const bool is_file = word.ends_with(".fits") || word.ends_with(".ecsv") ||
                           word.ends_with(".png") || word.ends_with(".jpg");
      arguments.push_back(is_file ? path(word) : word);
    }
    const Operation& operation = find_operation(name);
    OperationCall call = parse_call(operation, arguments);
    call.threads = 2;
    printed_.clear();
    call.print = [this](const std::string& text) { printed_ += text; };
    return operation.run(call);
  }

  /// Runs the line and reads the table that it writes.
  DataTable measure(const std::string& line) {
    std::filesystem::remove(path("table.fits"));
    run(line + " --table table.fits");
    expect_fitsverify_clean(path("table.fits"));
    return read_data_table(path("table.fits"));
  }

  std::string error(const std::string& line) {
    try {
      run(line);
    } catch (const InputError& e) {
      std::string text = e.what();
      const std::string folder = folder_.path().string() + "/";
      for (std::size_t at; (at = text.find(folder)) != std::string::npos;) {
        text.erase(at, folder.size());
      }
      return text;
    }
    return "none";
  }

  static double number(const DataTable& table, const std::string& name, std::size_t row = 0) {
    for (const DataColumn& column : table.columns) {
      if (column.name != name) continue;
      if (const auto* numbers = std::get_if<std::vector<double>>(&column.values)) {
        return numbers->at(row);
      }
      return static_cast<double>(std::get<std::vector<std::int64_t>>(column.values).at(row));
    }
    ADD_FAILURE() << "no column " << name;
    return 0;
  }
  static std::string text(const DataTable& table, const std::string& name, std::size_t row = 0) {
    const auto column = std::ranges::find(table.columns, name, &DataColumn::name);
    return std::get<std::vector<std::string>>(column->values).at(row);
  }

  TemporaryFolder folder_;
  std::string printed_;
};

}  // namespace gamer
