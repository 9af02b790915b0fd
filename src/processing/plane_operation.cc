#include "processing/plane_operation.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "gamer/core/error.h"

namespace gamer {
namespace {

int plane_count(const FitsInput& input) {
  int count = 0;
  for (const FitsHdu& hdu : input.hdus()) count += hdu.planes;
  if (count == 0) throw InputError(fmt::format("{}: no image in it", input.name()));
  return count;
}

int image_count(const FitsInput& input) {
  int count = 0;
  for (const FitsHdu& hdu : input.hdus()) count += hdu.is_image() ? 1 : 0;
  return count;
}

}  // namespace

int output_bitpix(const OperationCall& call, const FitsHdu& hdu) {
  constexpr int kFloat = -32, kDouble = -64, kSmallInteger = 16;
  if (call.bitpix != 0) return call.bitpix;
  const bool fits_in_float =
      hdu.bitpix == kFloat || (hdu.bitpix > 0 && hdu.bitpix <= kSmallInteger);
  return fits_in_float ? kFloat : kDouble;
}

std::string hdu_label(const FitsInput& input, const FitsHdu& hdu) {
  if (image_count(input) == 1) return input.name();
  const std::string name = hdu.name.empty() ? fmt::format("{}", hdu.number) : hdu.name;
  return fmt::format("{}[{}]", input.name(), name);
}

void visit_planes(const FitsInput& input, int threads,
                  const std::function<void(const PlaneTask& task)>& use) {
  const int count = plane_count(input);
  int index = 0;
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    const FitsHdu& hdu = input.hdus()[i];
    for (int plane = 0; plane < hdu.planes; ++plane, ++index) {
      use({input.plane(i, plane), plane_info(hdu.header, plane, hdu.planes), hdu.header,
           hdu_label(input, hdu), index, count, threads});
    }
  }
}

void change_planes(const OperationCall& call, const PlaneChange& change, const HeaderChange& edit,
                   const ExtraImages& extra) {
  const FitsInput input(call.inputs.front());
  plane_count(input);
  FitsOutput output({call.output, call.overwrite});
  std::vector<std::vector<PlanePtr>> planes(input.hdus().size());
  std::size_t hdu_index = 0;
  // All of them first: what is wrong with a later plane is said before work begins.
  std::vector<std::vector<PlaneTask>> tasks(input.hdus().size());
  visit_planes(input, call.threads, [&](const PlaneTask& task) {
    while (planes[hdu_index].size() == static_cast<std::size_t>(input.hdus()[hdu_index].planes)) {
      ++hdu_index;
    }
    planes[hdu_index].push_back(change(task));
    tasks[hdu_index].push_back(task);
  });
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    const FitsHdu& hdu = input.hdus()[i];
    if (!hdu.is_image()) {
      output.copy(input, i);
      continue;
    }
    FitsHeader header = hdu.header;
    if (edit) edit(header, hdu.width, hdu.height, hdu.planes);
    header.set({"HISTORY", {}, call.history});
    const int bitpix = output_bitpix(call, hdu);
    output.write(header, planes[i], bitpix, call.threads);
    if (extra) {
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
    std::string option(name);
    for (char& c : option) c = c == '_' ? '-' : c;
    throw InputError(
        fmt::format("gutil {}: --{} has {} values for {} plane{}; give one, or one for "
                    "each",
                    call.operation, option, values.size(), task.count, task.count == 1 ? "" : "s"));
  }
  return values[static_cast<std::size_t>(task.index)];
}

}  // namespace gamer
