#pragma once

#include <span>
#include <string>
#include <vector>

#include "gamer/job/job.h"

namespace gamer {

/// Warnings about a job whose image can be made, one line each.
std::vector<std::string> job_warnings(const RenderJob& job);

/// Whether a row has light: pixels that are finite and differ from 0 in the output's precision.
bool has_light(std::span<const double> pixels, bool is_single_precision);

/// A warning that an image has no light, with the likely cause.
std::string darkness_warning(const RenderJob& job);

/// A warning with the number of rays that did not reach the tolerance; `where` names the files or
/// frames.
std::string shortfall_warning(const std::string& where, double rays);
/// The card UNCONV with this number of rays; no card for 0.
std::vector<Card> shortfall_cards(double rays);

}  // namespace gamer
