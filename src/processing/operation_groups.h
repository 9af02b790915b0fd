#pragma once

#include <vector>

#include "gamer/processing/operation.h"

namespace gamer {

/// The operations by group; operations() joins the groups.
std::vector<Operation> blur_operations();        ///< convolve, psf
std::vector<Operation> detector_operations();    ///< noise, inject
std::vector<Operation> geometry_operations();    ///< rotate, flip, crop, pad, bin, resample
std::vector<Operation> arithmetic_operations();  ///< add, subtract, multiply, average, scale
std::vector<Operation> file_operations();        ///< stack, header
std::vector<Operation> tone_operations();        ///< normalise, gamma, stretch, rgb
std::vector<Operation> measure_operations();     ///< stats, photometry, morphology, spectrum...

/// Operations of these groups with files of their own.
Operation inject_operation();
Operation morphology_operation();
Operation photometry_operation();
Operation profile_operation();
Operation rgb_operation();
Operation unwrap_operation();

}  // namespace gamer
