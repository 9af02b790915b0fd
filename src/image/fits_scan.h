#pragma once

#include <filesystem>
#include <string>

namespace gamer {

/// Walks over the headers of a FITS file (plain or gzip) before CFITSIO does, which (4.2) divides
/// by or counts up to what the cards of compressed images say, and copies names of columns that are
/// no strings beyond their place. Throws InputError with `label` where ZNAXIS, ZNAXISn, ZTILEn,
/// ZBITPIX, TTYPEn or TFORMn have values that cannot be. All else is left to CFITSIO.
void check_headers(const std::filesystem::path& path, const std::string& label);

}  // namespace gamer
