#pragma once

#include <optional>

#include "gamer/image/instrument.h"
#include "processing/plane_operation.h"

namespace gamer {

/// The option --instrument of an operation: an instrument whose values hold where the options of
/// the operation are not given.
class InstrumentOption {
 public:
  InstrumentOption() = default;  ///< none
  /// Reads the instrument, if one is asked for. Throws InputError.
  explicit InstrumentOption(const OperationCall& call);

  static Parameter parameter();

  bool is_given() const { return instrument_.has_value(); }
  /// Precondition: is_given().
  const Instrument& get() const { return *instrument_; }
  /// The band of a plane, by its label. Throws InputError.
  const Instrument::Band& band(const PlaneTask& task) const;

 private:
  std::string context_;
  std::optional<Instrument> instrument_;
};

}  // namespace gamer
