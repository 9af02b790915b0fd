#include "processing/measurement_table.h"

#include <fmt/ranges.h>

#include <filesystem>

#include "core/message.h"
#include "gamer/image/new_file.h"
#include "processing/table_text.h"

namespace gamer {

void put_count(DataTable& table, const std::string& name, std::int64_t value,
               const std::string& unit, const std::string& description) {
  put<std::int64_t>(table, name, value, unit, description);
}

void put_plane(DataTable& table, const PlaneTask& task) {
  put_count(table, "hdu", task.hdu, "", "from 0, the primary");
  put_count(table, "plane", task.info.plane + 1, "", "of its HDU, from 1");
  put<std::string>(table, "label", task.info.label, "", "band, name or wavelength");
}

ParameterTable with_output(ParameterTable table) {
  table.push_back(Parameter::boolean("json", false, "print JSON, not a table"));
  table.push_back(Parameter::text("table", std::nullopt, "write a table too: .ecsv or .fits"));
  return table;
}

void check_output(const OperationCall& call, const char* option,
                  std::initializer_list<const char*> suffixes) {
  if (!call.parameters.has(option)) return;
  const std::filesystem::path path = call.parameters.text(option);
  const std::string context = fmt::format("--{} '{}'", option, path.string());
  if (std::ranges::find(suffixes, path.extension().string()) == suffixes.end()) {
    throw wrong(call, "{}: expected a name that ends in {}", context, fmt::join(suffixes, " or "));
  }
  check_new_file(path, call.overwrite);
}

void check_table(const OperationCall& call) { check_output(call, "table", {".ecsv", ".fits"}); }

void check_radii(const OperationCall& call, const char* option) {
  if (!call.parameters.has(option)) return;
  const std::vector<double>& radii = call.parameters.numbers(option);
  if (radii[0] < radii[1]) return;
  throw wrong(call, "--{} {:g},{:g}: the outer radius must be larger than the inner one", option,
              radii[0], radii[1]);
}

void deliver(const OperationCall& call, const std::vector<DataTable>& tables,
             const DataTable& file) {
  if (call.parameters.has("table")) {
    const std::filesystem::path path = call.parameters.text("table");
    if (path.extension() == ".fits") {
      write_fits_table(path, file);
    } else {
      write_ecsv(path, file);
    }
  }
  std::string text;
  if (call.parameters.boolean("json")) {
    text = table_json(tables);
  } else {
    for (const DataTable& table : tables) {
      if (!text.empty()) text += '\n';
      text += table_text(table);
    }
  }
  call.print(text);
}

}  // namespace gamer
