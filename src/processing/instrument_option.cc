#include "processing/instrument_option.h"

#include "core/message.h"
#include "gamer/core/resources.h"

namespace gamer {

InstrumentOption::InstrumentOption(const OperationCall& call) {
  if (!call.parameters.has("instrument")) return;
  const std::string& name = call.parameters.text("instrument");
  context_ = fmt::format("gutil {}: --instrument {}: ", call.operation, name);
  Resources resources(default_data_folders());
  try {
    instrument_ = find_instrument(name, "", resources);
  } catch (const InputError& error) {
    throw InputError(context_ + error.what());
  }
}

Parameter InstrumentOption::parameter() {
  return Parameter::text("instrument", std::nullopt,
                         "a name in `instruments/`, or a file; other options replace its values");
}

const Instrument::Band& InstrumentOption::band(const PlaneTask& task) const {
  try {
    return instrument_->band(task.info.label);
  } catch (const InputError& error) {
    throw input_error("{}{}, plane {}: {}", context_, task.label, task.index + 1, error.what());
  }
}

}  // namespace gamer
