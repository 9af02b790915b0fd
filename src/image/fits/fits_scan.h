#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace gamer {

/// Whether a file that begins with these bytes may be FITS, plain or compressed with gzip.
bool begins_as_fits(std::string_view bytes);
/// Number of bytes that begins_as_fits() needs.
inline constexpr std::size_t fits_beginning = 6;

/// Checks the headers of a FITS file (plain or gzip) before CFITSIO reads them. CFITSIO (4.2)
/// trusts their cards: it overflows buffers, divides by zero, loops without end or reads
/// uninitialised memory. Throws InputError with `label` and the HDU where a header has no END, or
/// where mandatory cards are missing, misplaced, repeated or have impossible values. Cards of
/// compressed images and columns are checked, too; data are not.
void check_headers(const std::filesystem::path& path, const std::string& label);

}  // namespace gamer
