#include "processing/plane_operation.h"

#include <algorithm>

#include "gamer/core/capitals.h"
#include "gamer/core/near.h"
#include "gamer/image/fits/record_names.h"

namespace gamer {
namespace {

int plane_count(const FitsInput& input) {
  int count = 0;
  for (const FitsHdu& hdu : input.hdus()) count += hdu.planes;
  if (count == 0) throw input_error("{}: no image in it", input.name());
  return count;
}

}  // namespace

int output_bitpix(const OperationCall& call, const FitsHdu& hdu) {
  constexpr int float_bitpix = -32, double_bitpix = -64, small_integer = 16;
  // CFITSIO's type of 16-bit integers with BZERO 32768.
  constexpr int small_unsigned = 20;
  if (call.bitpix != 0) return call.bitpix;
  const bool fits_in_float = hdu.bitpix == float_bitpix || hdu.bitpix == small_unsigned ||
                             (hdu.bitpix > 0 && hdu.bitpix <= small_integer);
  return fits_in_float ? float_bitpix : double_bitpix;
}

std::string hdu_label(const FitsInput& input, const FitsHdu& hdu) {
  if (std::ranges::count_if(input.hdus(), &FitsHdu::is_image) == 1) return input.name();
  const std::string name = hdu.name.empty() ? fmt::format("{}", hdu.number) : hdu.name;
  return fmt::format("{}[{}]", input.name(), name);
}

std::vector<std::size_t> chosen_hdus(const std::string& operation, const FitsInput& input,
                                     const std::string& text) {
  const std::string wanted = in_capitals(text);
  std::vector<std::size_t> chosen;
  std::vector<std::string> names = {"first", "all"};
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    const FitsHdu& hdu = input.hdus()[i];
    const bool is_meant = wanted == "ALL" || wanted == fmt::format("{}", hdu.number) ||
                          (!hdu.name.empty() && wanted == in_capitals(hdu.name)) ||
                          (wanted == "FIRST" && hdu.is_image() && chosen.empty());
    if (is_meant) chosen.push_back(i);
    names.push_back(fmt::format("{}", hdu.number));
    if (!hdu.name.empty()) names.push_back(hdu.name);
  }
  if (chosen.empty() && wanted == "FIRST" && !input.hdus().empty()) chosen.push_back(0);
  if (chosen.empty()) {
    throw input_error("gutil {}: {} has no HDU {}; there are {}", operation, input.name(),
                      in_quotes(text), fmt::join(names, ", "));
  }
  return chosen;
}

PlaneInfo plane_info(const FitsInput& input, const FitsHdu& hdu, int plane) {
  PlaneInfo info = plane_info(hdu.header, plane, hdu.planes);
  if (info.role == PlaneRole::light) return info;
  const bool has_light = std::ranges::any_of(input.hdus(), [](const FitsHdu& other) {
    return other.is_image() && plane_info(other.header, 0, other.planes).role == PlaneRole::light;
  });
  if (!has_light) info.role = PlaneRole::light;
  return info;
}

bool is_record(const FitsHdu& hdu) { return hdu.name == record_table_name; }

void drop_record(FitsHeader& header) {
  for (const std::string& record : std::vector(header.records())) {
    const std::string key = FitsHeader::key_of(record);
    if (key.starts_with(record_key_stem)) header.remove(key);
  }
}

InputError variance_error(const OperationCall& call, const PlaneTask& task) {
  const FitsInput input(call.inputs.front());
  const auto image = std::ranges::find_if(input.hdus(), [&](const auto& hdu) {
    return hdu.is_image() && plane_info(input, hdu, 0).role == PlaneRole::light;
  });
  return wrong(call, "{} holds variances, which do not follow; take the image alone: \"{}[{}]\"",
               task.label, input.name(), image->number);
}

void visit_planes(const FitsInput& input, int threads,
                  const std::function<void(const PlaneTask& task)>& use) {
  const int count = plane_count(input);
  int index = 0;
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    const FitsHdu& hdu = input.hdus()[i];
    for (int plane = 0; plane < hdu.planes; ++plane, ++index) {
      use({input.plane(i, plane), plane_info(input, hdu, plane), hdu.header, hdu_label(input, hdu),
           index, count, threads, hdu.number});
    }
  }
}

namespace {

bool is_variance(const std::vector<PlaneTask>& tasks) {
  return tasks.front().info.role == PlaneRole::variance;
}

/// The tasks of each HDU of a file, numbered among planes that are not variances.
std::vector<std::vector<PlaneTask>> tasks_of(const OperationCall& call, const FitsInput& input) {
  std::vector<std::vector<PlaneTask>> tasks(input.hdus().size());
  std::size_t hdu_index = 0;
  int light_count = 0;
  visit_planes(input, call.threads, [&](const PlaneTask& task) {
    while (tasks[hdu_index].size() == static_cast<std::size_t>(input.hdus()[hdu_index].planes)) {
      ++hdu_index;
    }
    tasks[hdu_index].push_back(task);
    if (task.info.role == PlaneRole::light) ++light_count;
  });
  int first = 0, next = 0;  // of the last image that is no variance, and after it
  for (std::vector<PlaneTask>& of_file : tasks) {
    if (of_file.empty()) continue;
    if (!is_variance(of_file)) {
      first = next;
      next += static_cast<int>(of_file.size());
    }
    for (PlaneTask& task : of_file) {
      task.index = first + task.info.plane;
      task.count = light_count;
    }
  }
  return tasks;
}

/// Copies an HDU that is no image. With further inputs a record is left out.
void copy_other(const FitsInput& input, std::size_t hdu, bool is_combined, FitsOutput& output) {
  const FitsHdu& input_hdu = input.hdus()[hdu];
  if (is_combined && input_hdu.number == 0) {
    FitsHeader header = input_hdu.header;
    drop_record(header);
    output.copy(input, hdu, header);
  } else if (!is_combined || !is_record(input_hdu)) {
    output.copy(input, hdu);
  }
}

}  // namespace

void change_planes(const OperationCall& call, const PlaneChange& change, const HeaderChange& edit,
                   const ExtraImages& extra, const VarianceChange& variance) {
  const FitsInput input(call.inputs.front());
  plane_count(input);
  FitsOutput output({call.output, call.overwrite});
  const std::vector<std::vector<PlaneTask>> tasks = tasks_of(call, input);
  // All planes are prepared first, so that errors of later planes appear before work begins.
  std::vector<std::vector<PlanePtr>> planes(input.hdus().size());
  std::size_t size = 0;  // of the last image that is no variance
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (tasks[i].empty()) continue;
    const bool is_of_variance = is_variance(tasks[i]);
    if (is_of_variance && !variance.change) throw variance_error(call, tasks[i].front());
    if (!is_of_variance) size = tasks[i].size();
    if (tasks[i].size() != size) {
      throw wrong(call, "{} holds {} planes of variances, the image before {}",
                  tasks[i].front().label, tasks[i].size(), size);
    }
    for (const PlaneTask& task : tasks[i]) {
      planes[i].push_back(is_of_variance ? variance.change(task) : change(task));
    }
  }
  const bool is_combined = call.inputs.size() > 1;
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    const FitsHdu& hdu = input.hdus()[i];
    if (!hdu.is_image()) {
      copy_other(input, i, is_combined, output);
      continue;
    }
    FitsHeader header = hdu.header;
    if (is_combined) drop_record(header);
    const HeaderChange& edit_it = is_variance(tasks[i]) ? variance.edit : edit;
    if (edit_it) edit_it(header, hdu.width, hdu.height, hdu.planes);
    header.set({"HISTORY", {}, call.history});
    const int bitpix = output_bitpix(call, hdu);
    output.write(header, planes[i], bitpix, call.threads, hdu.further_axes);
    if (extra && !is_variance(tasks[i])) {
      for (const ExtraImage& image : extra(header, tasks[i])) {
        output.write(image.header, image.planes, bitpix, call.threads);
      }
    }
  }
  output.finish();
}

double plane_value(const OperationCall& call, std::string_view name, const PlaneTask& task) {
  const std::vector<double>& values = call.parameters.numbers(name);
  if (values.size() == 1) return values.front();
  if (values.size() != static_cast<std::size_t>(task.count)) {
    throw wrong(call, "{} has {} values for {} plane{}; give one, or one for each",
                option_name(name), values.size(), task.count, task.count == 1 ? "" : "s");
  }
  return values[static_cast<std::size_t>(task.index)];
}

}  // namespace gamer
