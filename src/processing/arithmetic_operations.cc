#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/processing/arithmetic.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"

namespace gamer {
namespace {

constexpr const char* kGroup = "Arithmetic";

/// The planes of a further input, to be combined with those of the first.
struct Operand {
  std::string name;
  std::vector<PlanePtr> planes;
  std::vector<std::string> units;
};

Operand read_operand(const std::string& name) {
  const FitsInput input(name);
  Operand operand;
  visit_planes(input, 1, [&](const PlaneTask& task) {
    operand.name = input.name();
    operand.planes.push_back(task.plane);
    operand.units.push_back(task.info.unit);
  });
  return operand;
}

/// The plane that goes with plane `task.index`: the one of that number, or the only one.
std::size_t partner(const Operand& operand, const PlaneTask& task, const std::string& operation) {
  const std::size_t count = operand.planes.size();
  if (count != 1 && count != static_cast<std::size_t>(task.count)) {
    throw InputError(fmt::format("gutil {}: {} has {} planes, {} has {}; expected as many, or one",
                                 operation, operand.name, count, task.label, task.count));
  }
  const std::size_t index = count == 1 ? 0 : static_cast<std::size_t>(task.index);
  const Plane& plane = *operand.planes[index];
  if (plane.width() != task.plane->width() || plane.height() != task.plane->height()) {
    throw InputError(fmt::format("gutil {}: {} has {} x {} pixels, {} has {} x {}", operation,
                                 operand.name, plane.width(), plane.height(), task.label,
                                 task.plane->width(), task.plane->height()));
  }
  return index;
}

int combine_files(const OperationCall& call, Combination combination) {
  std::vector<Operand> operands;
  for (std::size_t i = 1; i < call.inputs.size(); ++i) {
    operands.push_back(read_operand(call.inputs[i]));
  }
  const bool can_skip = combination == Combination::sum || combination == Combination::mean;
  const bool skip = can_skip && call.parameters.boolean("skip_missing");
  change_planes(call, [&](const PlaneTask& task) {
    std::vector<PlanePtr> planes = {task.plane};
    for (const Operand& operand : operands) {
      const std::size_t index = partner(operand, task, call.operation);
      const std::string& unit = operand.units[index];
      const bool differs = !unit.empty() && !task.info.unit.empty() && unit != task.info.unit;
      if (differs && combination != Combination::product) {
        throw InputError(fmt::format("gutil {}: the pixels of {} are in {}, those of {} in {}",
                                     call.operation, operand.name, unit, task.label,
                                     task.info.unit));
      }
      planes.push_back(operand.planes[index]);
    }
    return combined(std::move(planes), combination, skip);
  });
  return 0;
}

Operation combining(const char* name, Combination combination, const char* summary,
                    const std::string& description) {
  Operation operation;
  operation.name = name;
  operation.group = kGroup;
  operation.summary = summary;
  operation.description =
      description +
      " Plane by plane: every file has as many planes as the first, or one for all. The header is "
      "the first file's. A pixel that is missing (NaN) in one file is missing.";
  operation.most_inputs = 0;
  operation.least_inputs = 2;
  if (combination == Combination::sum || combination == Combination::mean) {
    operation.parameters = {{"skip_missing",
                             ParameterType::boolean,
                             "",
                             {},
                             false,
                             "leave missing pixels out instead"}};
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
  change_planes(call, change, edit);
  return 0;
}

}  // namespace

std::vector<Operation> arithmetic_operations() {
  Operation scale;
  scale.name = "scale";
  scale.group = kGroup;
  scale.summary = "Multiply by a number and add one";
  scale.description =
      "v' = factor v + offset. Without --unit the light changes and the unit stays; with --unit "
      "the "
      "light stays and BUNIT, MAGZERO, PHOTZP and PHOTFLAM follow.";
  scale.parameters = {
      {"factor", ParameterType::numbers, "", Interval::any(), std::vector<double>{1},
       "one for all planes, or one for each"},
      {"offset", ParameterType::numbers, "unit of the pixels", Interval::any(),
       std::vector<double>{0}, "one for all planes, or one for each"},
      {"unit", ParameterType::text, "", {}, {}, "new BUNIT, of which the old is --factor"},
  };
  scale.example = "scale --factor 1e-3 --unit uJy in.fits out.fits";
  scale.run = scale_file;
  return {
      combining("add", Combination::sum, "Add images", "a + b + ..."),
      combining("subtract", Combination::difference, "Subtract images", "a - b - ..."),
      combining("multiply", Combination::product, "Multiply images",
                "a b ...: weights, masks, flat fields."),
      combining("average", Combination::mean, "Mean of images", "(a + b + ...)/n."),
      scale,
  };
}

}  // namespace gamer
