#include <pybind11/stl.h>

#include <string>
#include <utility>
#include <vector>

#include "background.h"
#include "bindings.h"
#include "gamer/core/cancellation.h"
#include "gamer/parallel/executor.h"
#include "gamer/processing/operation.h"

namespace gamer::python {
namespace {

namespace py = pybind11;

const char* result_name(Operation::Result result) {
  switch (result) {
    case Operation::Result::fits: return "fits";
    case Operation::Result::picture: return "picture";
    case Operation::Result::text: return "text";
  }
  return "";
}

py::list list_operations() {
  py::list result;
  for (const Operation& operation : operations()) {
    py::dict one;
    one["name"] = operation.name;
    one["aliases"] = operation.aliases;
    one["group"] = operation.group;
    one["summary"] = operation.summary;
    one["description"] = operation.description;
    one["least_inputs"] = operation.least_inputs;
    one["most_inputs"] = operation.most_inputs;
    one["result"] = result_name(operation.result);
    one["parameters"] = describe(operation.parameters);
    result.append(one);
  }
  return result;
}

/// Runs an operation as gutil does. Returns its answer and the printed text.
std::pair<int, std::string> run_operation(const std::string& name,
                                          const std::vector<std::string>& arguments) {
  const Operation& operation = find_operation(name);
  OperationCall call = parse_call(operation, arguments);
  if (call.threads == 0) call.threads = available_cores();
  std::string printed;
  call.print = [&](const std::string& text) { printed += text; };
  int answer = 0;
  Background work([&](const Cancellation& cancellation) {
    const CancellationScope scope(&cancellation);
    answer = operation.run(call);
  });
  work.finish();
  return {answer, printed};
}

}  // namespace

void bind_process(py::module_& module) {
  module.def("operations", &list_operations, "The declarations of gutil's operations.");
  module.def("run_operation", &run_operation, py::arg("name"), py::arg("arguments"));
}

}  // namespace gamer::python
