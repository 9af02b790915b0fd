#include "gamer/job/record.h"

#include <algorithm>
#include <array>

#include "core/message.h"
#include "core/text.h"
#include "gamer/image/fits/fits.h"
#include "gamer/image/png_table.h"
#include "image/image_suffix.h"

namespace gamer {
namespace {

std::string unpack(std::string_view& packed) {
  std::optional<std::string> text = take_netstring(packed);
  if (!text) throw RunError("the record of the job is damaged");
  return std::move(*text);
}

const std::array<std::string, 3> table_columns = {"NAME", "LABEL", "TEXT"};

}  // namespace

const Resources::Text* find_text(const Record& record, std::string_view name) {
  const auto found = std::ranges::find(record, name, &Resources::Text::name);
  return found == record.end() ? nullptr : &*found;
}

Resources::Text* find_text(Record& record, std::string_view name) {
  const auto found = std::ranges::find(record, name, &Resources::Text::name);
  return found == record.end() ? nullptr : &*found;
}

const Resources::Text& text_of(const Record& record, std::string_view name) {
  const Resources::Text* text = find_text(record, name);
  if (text == nullptr) throw input_error("the record holds no '{}'", name);
  return *text;
}

void pack_record(const Record& record, const std::function<void(std::string_view)>& take) {
  // Netstrings, see take_netstring().
  const auto pack = [&](std::string_view text) {
    take(fmt::format("{}:", text.size()));
    take(text);
  };
  for (const Resources::Text& text : record) {
    pack(text.name);
    pack(text.label);
    pack(text.content);
  }
}

std::string pack_record(const Record& record) {
  std::size_t size = 0;
  pack_record(record, [&](std::string_view piece) { size += piece.size(); });
  std::string packed;
  packed.reserve(size);
  pack_record(record, [&](std::string_view piece) { packed += piece; });
  return packed;
}

Record unpack_record(std::string_view packed) {
  Record record;
  while (!packed.empty()) {
    // Elements in braces are evaluated in their order.
    record.push_back({unpack(packed), unpack(packed), unpack(packed)});
  }
  return record;
}

TextTable record_table(const Record& record) {
  TextTable table;
  table.name = record_table_name;
  table.columns.assign(table_columns.begin(), table_columns.end());
  table.made_rows = [record](const TextTable::TakeRow& take) {
    for (const Resources::Text& text : record) {
      const std::array<std::string_view, 3> cells = {text.name, text.label, text.content};
      take(cells);
    }
  };
  return table;
}

Record record_from_table(const TextTable& table) {
  if (!std::equal(table.columns.begin(), table.columns.end(), table_columns.begin(),
                  table_columns.end())) {
    throw input_error("the table {} has not the columns NAME, LABEL, TEXT", table.name);
  }
  Record record;
  table.for_each_row([&](std::span<const std::string_view> row) {
    record.push_back({std::string(row[0]), std::string(row[1]), std::string(row[2])});
  });
  return record;
}

bool keeps_record(const std::filesystem::path& image) {
  const std::optional<ImageSuffix> suffix = image_suffix(image);
  return suffix && suffix != ImageSuffix::bmp;
}

Record read_record(const std::filesystem::path& image) {
  const TextTable table = image_suffix(image) == ImageSuffix::png
                              ? read_png_table(image, record_table_name)
                              : read_fits_table(image, record_table_name);
  try {
    return record_from_table(table);
  } catch (const InputError& error) {
    throw InputError({image.generic_string(), 0, 0}, error.what());
  }
}

}  // namespace gamer
