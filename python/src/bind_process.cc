#include <pybind11/stl.h>

#include <string>
#include <utility>
#include <vector>

#include "bindings.h"
#include "gamer/parallel/executor.h"
#include "gamer/processing/operation.h"

namespace gamer::python {
namespace {

namespace py = pybind11;

const char* result_name(Operation::Result result) {
  switch (result) {
    case Operation::Result::fits:
      return "fits";
    case Operation::Result::picture:
      return "picture";
    case Operation::Result::text:
      return "text";
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

/// Runs an operation as gutil does. Returns its answer and what it printed.
std::pair<int, std::string> run_operation(const std::string& name,
                                          const std::vector<std::string>& arguments) {
  const py::gil_scoped_release release;
  const Operation& operation = find_operation(name);
  OperationCall call = parse_call(operation, arguments);
  if (call.threads == 0) call.threads = available_cores();
  std::string printed;
  call.print = [&](const std::string& text) { printed += text; };
  const int answer = operation.run(call);
  return {answer, printed};
}

}  // namespace

void bind_process(py::module_& module) {
  module.def("operations", &list_operations, "The declarations of gutil's operations.");
  module.def("run_operation", &run_operation, py::arg("name"), py::arg("arguments"));
}

}  // namespace gamer::python
