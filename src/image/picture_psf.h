#pragma once

#include <cstdint>

#include "gamer/image/image.h"
#include "gamer/image/picture_style.h"
#include "image/convolution/psf.h"

namespace gamer {

/// Side of picture_psf(), pixels.
int picture_psf_side(double seeing);

/// How a picture shows a point, with the sum 1. Most light is in a Moffat profile of the FWHM
/// `style.seeing` > 0 and the exponent 2.5. Its wings fall as d^-5, so that brighter stars look
/// larger. The aureole of King (1971, PASP 83, 199) has 4 % of the round light. With distances in
/// units of the FWHM and the reach R, it is
///   (1 - (d/R)^2)^2 / (1 + (d/4)^2),
/// which falls as d^-2, and ends at R. Four spikes along rows and columns have the share
/// `style.spikes` of the light. At the distances u along a spike and v across it, a spike's light
/// is
///   (1 - (u/R)^2)^2 / (1 + (u/2)^2) exp(-4 ln 2 v^2).
/// Along a spike the light of a sharp edge's diffraction falls as u^-2. The reach is 64
/// FWHM, or 192 pixels where that is less, but at least 24 FWHM. The stamp ends there, too.
Stamp picture_psf(const PictureStyle& style);

/// Memory that picture_psf() and blur() take, bytes.
std::uint64_t blur_memory(int width, int height, const PictureStyle& style);

/// Convolves each channel with the stamp. Pixels beyond the edges mirror those within.
void blur(Image& channels, const Stamp& psf);

}  // namespace gamer
