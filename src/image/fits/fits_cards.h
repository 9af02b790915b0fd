#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/image/image.h"
#include "image/fits/fits_file.h"

namespace gamer {

/// The caller's cards, with DATE, ORIGIN and CREATOR of this run where the caller gives none.
std::vector<Card> common_cards(const std::vector<Card>& given);
std::vector<Card> without_common_cards(const std::vector<Card>& cards);

/// Appends WAVELENn and the cards of the planes [first, first + count) of one HDU; keys are
/// numbered where there are several planes.
void append_plane_cards(std::vector<Card>& cards, const ImageHeader& header, int first, int count);

/// Appends a card to the current header, see card_records().
void write_card(FitsFile& file, const Card& card);

/// Writes all cards. If strings are continued it also writes LONGSTRN, which announces them.
void write_cards(FitsFile& file, const std::vector<Card>& cards);

/// The current header's records, unchanged.
std::vector<std::string> read_records(FitsFile& file);

/// The current header's cards, without cards of data layout, compression and checksums.
std::vector<Card> read_cards(FitsFile& file);

/// Writes DATASUM and CHECKSUM. Their comments do not contain the time, so that equal files have
/// equal bytes. `data_sum` is the sum of the HDU's data if known; otherwise they are read again.
void write_checksum(FitsFile& file, std::optional<std::uint32_t> data_sum = std::nullopt);
/// Reserves room for DATASUM and CHECKSUM where the header must not grow later.
void reserve_checksum(FitsFile& file);

/// Cells of a text column as stored, without blanks at the end; rows from 1.
std::vector<std::string> read_text_cells(FitsFile& file, int column, LONGLONG first,
                                         LONGLONG count);

/// The texts as CFITSIO takes them.
std::vector<char*> pointers_to(std::vector<std::string>& texts);

/// Both functions append a binary table HDU; `common` cards come first. gamer/image/fits.h
/// describes the format.
void write_data_table(FitsFile& file, const DataTable& table, const std::vector<Card>& common);
void write_text_table(FitsFile& file, const TextTable& table, const std::vector<Card>& common);

/// Whether the current HDU is a table that write_text_table() made.
bool is_text_table(FitsFile& file);
TextTable read_text_table(FitsFile& file);

/// Reads the EXTNAME of the current HDU into `name`, and appends its other cards except common
/// ones.
void read_table_cards(FitsFile& file, std::string& name, std::vector<Card>& cards);

/// Whether the key is DATE, ORIGIN or CREATOR. Every HDU has these cards; a TextTable leaves them
/// out.
bool is_common_card(std::string_view key);

}  // namespace gamer
