#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/image/plane.h"
#include "gamer/processing/operation.h"
#include "processing/plane_info.h"

namespace gamer {

/// One plane that an operation works on.
struct PlaneTask {
  PlanePtr plane;
  PlaneInfo info;
  const FitsHeader& header;  ///< of its HDU
  std::string label;         ///< file, and HDU where there are several, for messages
  int index = 0;             ///< among all planes of the file, from 0; see change_planes()
  int count = 1;             ///< planes of the file
  int threads = 1;
};

/// Makes the planes of the output; all planes of an HDU must become one size.
using PlaneChange = std::function<PlanePtr(const PlaneTask& task)>;
/// Changes the header of an image HDU of `planes` planes, `width` and `height` being the input's.
using HeaderChange = std::function<void(FitsHeader& header, int width, int height, int planes)>;

/// A further image HDU of the output.
struct ExtraImage {
  FitsHeader header;
  std::vector<PlanePtr> planes;
};
/// Makes what follows an image HDU with the output's `header`, from its planes.
using ExtraImages = std::function<std::vector<ExtraImage>(const FitsHeader& header,
                                                          const std::vector<PlaneTask>& tasks)>;

/// What an operation does with images that hold the variance of others. Without `change` it
/// refuses them: what becomes of them is no plane of variances.
struct VarianceChange {
  PlaneChange change = {};
  HeaderChange edit = {};
};

/// The InputError of an operation that cannot change the variance `task`.
InputError variance_error(const OperationCall& call, const PlaneTask& task);

/// Whether an HDU is the table of a record; see gamer/image/record_names.h. What is made of several
/// images has no record: the first one's would make that image alone.
bool is_record(const FitsHdu& hdu);
/// Removes the cards of a record.
void drop_record(FitsHeader& header);

/// An operation with one output: images of the first input go through `change` plane by plane and
/// their header through `edit`, HISTORY is added, every other HDU is copied. Where there are
/// further inputs, the record is dropped. Images of role variance go through `variance` instead;
/// their tasks have the index of the plane whose variance they are (of the image before), and all
/// tasks the count of the others. Throws InputError where the file holds no image.
void change_planes(const OperationCall& call, const PlaneChange& change,
                   const HeaderChange& edit = {}, const ExtraImages& extra = {},
                   const VarianceChange& variance = {});

/// BITPIX of what an HDU becomes: as asked for, else its own; of integers the floating-point type
/// that holds them.
int output_bitpix(const OperationCall& call, const FitsHdu& hdu);

/// What messages call an HDU: the file, and the HDU's name or number where there are several.
std::string hdu_label(const FitsInput& input, const FitsHdu& hdu);

/// What the header of an image HDU says about a plane. Where a file holds variances alone, as
/// "a.fits[VARIANCE]" does, they are taken as any image.
PlaneInfo plane_info(const FitsInput& input, const FitsHdu& hdu, int plane);

/// Calls `use` for every plane of a file, in order.
void visit_planes(const FitsInput& input, int threads,
                  const std::function<void(const PlaneTask& task)>& use);

/// A list with one value for all planes, or one per plane: the value of plane `index`. Throws
/// InputError "gutil <operation>: --<name> has 2 values for 3 planes".
double plane_value(const OperationCall& call, std::string_view name, const PlaneTask& task);

}  // namespace gamer
