#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace gamer {

/// Whether a file that begins with these bytes may be FITS, plain or compressed by gzip.
bool begins_as_fits(std::string_view bytes);
/// So many bytes tell.
inline constexpr std::size_t fits_beginning = 6;

/// Walks over the headers of a FITS file (plain or gzip) before CFITSIO does. CFITSIO (4.2)
/// believes their cards: it writes beyond its buffers, divides by zero, counts without end or reads
/// memory that nothing was written to. Throws InputError with `label` and the HDU where a header
/// has no END, mandatory cards are missing, out of place, there twice or have values that cannot
/// be, or the cards of a compressed image or a column do. The data are not looked at.
void check_headers(const std::filesystem::path& path, const std::string& label);

}  // namespace gamer
