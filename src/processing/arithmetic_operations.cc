#include <algorithm>
#include <cmath>
#include <ranges>
#include <string>
#include <utility>
#include <vector>

#include "processing/arithmetic.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"

namespace gamer {
namespace {

/// Planes of a further input, which are combined with those of the first.
struct Operand {
  std::string name;
  std::vector<PlanePtr> planes;
  std::vector<PlaneInfo> infos;
  std::vector<PlanePtr> variances;  ///< of these planes; empty where the file has none
};

Operand read_operand(const OperationCall& call, const std::string& name) {
  const FitsInput input(name);
  Operand operand;
  operand.name = input.name();
  visit_planes(input, 1, [&](const PlaneTask& task) {
    if (task.info.role == PlaneRole::variance) {
      operand.variances.push_back(task.plane);
    } else {
      operand.planes.push_back(task.plane);
      operand.infos.push_back(task.info);
    }
  });
  if (!operand.variances.empty() && operand.variances.size() != operand.planes.size()) {
    throw wrong(call, "{} holds {} planes, and {} of variances", operand.name,
                operand.planes.size(), operand.variances.size());
  }
  return operand;
}

/// Index of the operand's plane for plane `task.index`: the plane of that number, or the only one.
std::size_t partner(const Operand& operand, const PlaneTask& task, const std::string& operation) {
  const std::size_t count = operand.planes.size();
  if (count != 1 && count != static_cast<std::size_t>(task.count)) {
    throw input_error("gutil {}: {} has {} planes, {} has {}; expected as many, or one", operation,
                      operand.name, count, task.label, task.count);
  }
  const std::size_t index = count == 1 ? 0 : static_cast<std::size_t>(task.index);
  const Plane& plane = *operand.planes[index];
  if (plane.width() != task.plane->width() || plane.height() != task.plane->height()) {
    throw input_error("gutil {}: {} has {} x {} pixels, {} has {} x {}", operation, operand.name,
                      plane.width(), plane.height(), task.label, task.plane->width(),
                      task.plane->height());
  }
  return index;
}

/// Checks that values to be added have one unit and one zero point.
void check_units(const OperationCall& call, const Operand& operand, const PlaneInfo& other,
                 const PlaneTask& task) {
  constexpr double zero_point_error = 1e-6;
  const PlaneInfo& info = task.info;
  if (!other.unit.empty() && !info.unit.empty() && other.unit != info.unit) {
    throw wrong(call, "the pixels of {} are in {}, those of {} in {}", operand.name, other.unit,
                task.label, info.unit);
  }
  if (!other.zero_point || !info.zero_point) return;
  if (std::abs(*other.zero_point - *info.zero_point) > zero_point_error) {
    throw wrong(call, "MAGZERO of {} is {}, of {} {}; gutil scale --unit makes them the same",
                operand.name, *other.zero_point, task.label, *info.zero_point);
  }
}

/// The unit of a product of values with these units.
std::string product_unit(const std::vector<std::string>& units) {
  const auto is_unit = [](const std::string& unit) { return !unit.empty(); };
  return fmt::format("{}", fmt::join(units | std::views::filter(is_unit), " "));
}

int combine_files(const OperationCall& call, Combination combination) {
  std::vector<Operand> operands;
  for (std::size_t i = 1; i < call.inputs.size(); ++i) {
    operands.push_back(read_operand(call, call.inputs[i]));
  }
  const bool is_mean = combination == Combination::mean;
  const bool is_product = combination == Combination::product;
  const bool can_skip = combination == Combination::sum || is_mean;
  const bool skip = can_skip && call.parameters.boolean("skip_missing");
  std::vector<std::vector<std::string>> units;  // [plane][factor]
  const PlaneChange change = [&](const PlaneTask& task) {
    std::vector<PlanePtr> planes = {task.plane};
    units.push_back({task.info.unit});
    if (combination == Combination::sum) {
      refuse_magnitudes(call.operation, task.label, task.info.unit);
    }
    for (const Operand& operand : operands) {
      const std::size_t index = partner(operand, task, call.operation);
      if (!is_product) check_units(call, operand, operand.infos[index], task);
      units.back().push_back(operand.infos[index].unit);
      planes.push_back(operand.planes[index]);
    }
    return combined(std::move(planes), combination, skip);
  };
  std::size_t edited = 0;
  const HeaderChange edit = [&](FitsHeader& header, int, int, int planes) {
    const std::vector<std::string>& factors = units[edited];
    edited += static_cast<std::size_t>(planes);
    const bool is_more = std::any_of(factors.begin() + 1, factors.end(),
                                     [](const std::string& unit) { return !unit.empty(); });
    if (!is_product || !is_more) return;
    drop_calibration(header, planes);
    header.set("BUNIT", product_unit(factors));
  };
  // The variance of a sum or difference is the sum of the variances. Exact operands have no
  // variance.
  VarianceChange variance;
  variance.change = [&](const PlaneTask& task) {
    if (is_product || (skip && is_mean)) throw variance_error(call, task);
    std::vector<PlanePtr> planes = {task.plane};
    for (const Operand& operand : operands) {
      const std::size_t index = partner(operand, task, call.operation);
      if (!operand.variances.empty()) planes.push_back(operand.variances[index]);
    }
    const PlanePtr sum = combined(std::move(planes), Combination::sum, skip);
    if (!is_mean) return sum;
    const auto count = static_cast<double>(operands.size() + 1);
    return scaled(sum, 1 / (count * count), 0);
  };
  change_planes(call, change, edit, {}, variance);
  return 0;
}

Operation combining(const char* name, Combination combination, const char* summary,
                    const std::string& description) {
  Operation operation;
  operation.name = name;
  operation.summary = summary;
  operation.description =
      description +
      " The operation works plane by plane. Every file has the number of planes of the first, or "
      "one plane for all. The header is the first file's. A pixel that is missing (NaN) in one "
      "file is missing in the result. " +
      (combination == Combination::product
           ? "The units are multiplied (BUNIT 'nJy s'). If a further file has a unit, the cards of "
             "calibration are deleted: MAGZERO, PHOTZP, PHOTFLAM, GAIN, SATURATE. Files with "
             "variances (EXTNAME VARIANCE, ..._VARIANCE) are an error."
           : "Units and zero points (MAGZERO) must agree. Variances of the first file (EXTNAME "
             "VARIANCE, ..._VARIANCE) become those of the result; a file without variances counts "
             "as exact.");
  operation.most_inputs = 0;
  operation.least_inputs = 2;
  if (combination == Combination::sum || combination == Combination::mean) {
    operation.parameters = {
        Parameter::boolean("skip_missing", false, "leave missing pixels out of the result")};
  }
  operation.example = fmt::format("{} in.fits in2.fits out.fits", name);
  operation.run = [combination](const OperationCall& call) {
    return combine_files(call, combination);
  };
  return operation;
}

int scale_file(const OperationCall& call) {
  const ParameterSet& parameters = call.parameters;
  const bool has_unit = parameters.has("unit");
  const std::vector<double>& factors = parameters.numbers("factor");
  const bool is_conversion = factors.size() == 1 && factors.front() > 0 &&
                             parameters.numbers("offset") == std::vector<double>{0};
  if (has_unit && !is_conversion) {
    throw InputError(
        "gutil scale: --unit goes with one positive --factor and no --offset: the same light in "
        "another unit");
  }
  const PlaneChange change = [&](const PlaneTask& task) {
    return scaled(task.plane, plane_value(call, "factor", task), plane_value(call, "offset", task));
  };
  const HeaderChange edit = [&](FitsHeader& header, int, int, int planes) {
    if (has_unit) change_unit(header, planes, factors.front(), parameters.text("unit"));
  };
  VarianceChange variance;
  variance.change = [&](const PlaneTask& task) {
    const double factor = plane_value(call, "factor", task);
    return scaled(task.plane, factor * factor, 0);
  };
  variance.edit = [&](FitsHeader& header, int, int, int) {
    if (has_unit) header.set("BUNIT", squared_unit(parameters.text("unit")));
  };
  change_planes(call, change, edit, {}, variance);
  return 0;
}

Operation scale_operation() {
  return {.name = "scale",
          .summary = "Multiply by a number and add an offset",
          .description =
              "v' = factor v + offset. Without --unit the light changes and the unit stays. With "
              "--unit the light stays, and BUNIT, MAGZERO, PHOTZP, PHOTFLAM, GAIN and SATURATE "
              "follow. Variances (EXTNAME VARIANCE, ..._VARIANCE) are multiplied by factor^2.",
          .parameters =
              {
                  Parameter::numbers("factor", "", Interval::any(), std::vector<double>{1},
                                     "one for all planes, or one for each"),
                  Parameter::numbers("offset", "unit of the pixels", Interval::any(),
                                     std::vector<double>{0}, "one for all planes, or one for each"),
                  Parameter::text("unit", std::nullopt,
                                  "new BUNIT; one old unit is --factor new units"),
              },
          .example = "scale --factor 1e-3 --unit uJy in.fits out.fits",
          .run = scale_file};
}

}  // namespace

std::vector<Operation> arithmetic_operations() {
  return {
      combining("add", Combination::sum, "Add images", "The result is a + b + ... over all files."),
      combining("subtract", Combination::difference, "Subtract images",
                "The result is a - b - ... over all files."),
      combining("multiply", Combination::product, "Multiply images",
                "The result is a b ... over all files, for weights, masks and flat fields."),
      combining("average", Combination::mean, "Mean of images",
                "The result is (a + b + ...)/n over n files."),
      scale_operation(),
  };
}

}  // namespace gamer
