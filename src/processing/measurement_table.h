#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "gamer/core/parameter.h"
#include "gamer/image/data_table.h"
#include "processing/plane_operation.h"

namespace gamer {

// The shared parts of operations that measure: options, tables of results, and messages.

/// Appends a value to the column of that name; the table's first row makes the columns.
template <class Value>
void put(DataTable& table, const std::string& name, const Value& value,
         const std::string& unit = {}, const std::string& description = {}) {
  auto column =
      std::ranges::find_if(table.columns, [&](const DataColumn& one) { return one.name == name; });
  if (column == table.columns.end()) {
    table.columns.push_back({name, unit, description, std::vector<Value>()});
    column = table.columns.end() - 1;
  }
  std::get<std::vector<Value>>(column->values).push_back(value);
}
void put_count(DataTable& table, const std::string& name, std::int64_t value,
               const std::string& unit = {}, const std::string& description = {});
/// Appends the columns that identify the plane of a row.
void put_plane(DataTable& table, const PlaneTask& task);

/// The table of options with --json and --table.
ParameterTable with_output(ParameterTable table);
/// Checks an option's output file before work begins: suffix, folder, and --overwrite.
void check_output(const OperationCall& call, const char* option,
                  std::initializer_list<const char*> suffixes);
void check_table(const OperationCall& call);
/// Checks an option of an inner and an outer radius, if it is given.
void check_radii(const OperationCall& call, const char* option);
/// Prints `tables`, and writes `file` if --table is given.
void deliver(const OperationCall& call, const std::vector<DataTable>& tables,
             const DataTable& file);

}  // namespace gamer
