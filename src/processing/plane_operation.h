#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/message.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/plane.h"
#include "gamer/processing/operation.h"
#include "processing/plane_info.h"

namespace gamer {

/// One plane that an operation works on.
struct PlaneTask {
  PlanePtr plane;
  PlaneInfo info;
  const FitsHeader& header;  ///< header of its HDU
  std::string label;         ///< file, and HDU where there are several, for messages
  int index = 0;             ///< number in the file, from 0; see change_planes()
  int count = 1;             ///< planes of the file
  int threads = 1;
  int hdu = 0;  ///< number of its HDU, from 0
};

/// An InputError "gutil <operation>: <message>", with the message formatted as by fmt::format().
template <class... Values>
InputError wrong(const OperationCall& call, fmt::format_string<Values...> message,
                 Values&&... values) {
  return input_error("gutil {}: {}", call.operation,
                     fmt::format(message, std::forward<Values>(values)...));
}

/// Makes an output plane; all planes of an HDU must become one size.
using PlaneChange = std::function<PlanePtr(const PlaneTask& task)>;
/// Changes the header of an image HDU of `planes` planes; `width` and `height` are the input's.
using HeaderChange = std::function<void(FitsHeader& header, int width, int height, int planes)>;

/// A further image HDU of the output.
struct ExtraImage {
  FitsHeader header;
  std::vector<PlanePtr> planes;
};
/// Makes the HDUs that follow an image HDU, from its planes and the output's `header`.
using ExtraImages = std::function<std::vector<ExtraImage>(const FitsHeader& header,
                                                          const std::vector<PlaneTask>& tasks)>;

/// The treatment of variance images by an operation. An operation without `change` refuses them,
/// since its result would not be a variance.
struct VarianceChange {
  PlaneChange change = {};
  HeaderChange edit = {};
};

/// The InputError of an operation that cannot change the variance `task`.
InputError variance_error(const OperationCall& call, const PlaneTask& task);

/// Whether an HDU is the table of a record; see gamer/image/record_names.h. Results of several
/// images have no record, since the record of the first image would make that image alone.
bool is_record(const FitsHdu& hdu);
/// Removes the cards of a record.
void drop_record(FitsHeader& header);

/// Runs an operation with one output. Images of the first input go through `change` plane by plane,
/// and their header through `edit`. HISTORY is added, and every other HDU is copied. With further
/// inputs the record is dropped. Images of role variance go through `variance` instead. The task of
/// a variance has the index of the plane of the preceding image to which it belongs. The counts of
/// tasks leave variances out. Throws InputError where the file has no image.
void change_planes(const OperationCall& call, const PlaneChange& change,
                   const HeaderChange& edit = {}, const ExtraImages& extra = {},
                   const VarianceChange& variance = {});

/// BITPIX of an output HDU: that of the call, else that of the input. Integers get the
/// floating-point type that holds them.
int output_bitpix(const OperationCall& call, const FitsHdu& hdu);

/// An HDU's name in messages: the file, with the HDU's name or number where there are several.
std::string hdu_label(const FitsInput& input, const FitsHdu& hdu);

/// Indices in hdus() of the HDUs that a text names: an EXTNAME in any case, a number, "first" (the
/// first image) or "all". Throws InputError "gutil <operation>: ...", with all names.
std::vector<std::size_t> chosen_hdus(const std::string& operation, const FitsInput& input,
                                     const std::string& text);

/// PlaneInfo of a plane of an image HDU. Where a file has only variances, as "a.fits[VARIANCE]",
/// they count as ordinary images.
PlaneInfo plane_info(const FitsInput& input, const FitsHdu& hdu, int plane);

/// Calls `use` for every plane of a file, in order.
void visit_planes(const FitsInput& input, int threads,
                  const std::function<void(const PlaneTask& task)>& use);

/// The value for plane `index` in a list of one value for all planes or one per plane. Throws
/// InputError "gutil <operation>: --<name> has 2 values for 3 planes".
double plane_value(const OperationCall& call, std::string_view name, const PlaneTask& task);

}  // namespace gamer
