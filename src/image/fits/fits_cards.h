#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/image/image.h"
#include "image/fits/card_record.h"
#include "image/fits/fits_file.h"

namespace gamer {

/// DATE, ORIGIN and CREATOR of this run, or as the caller gives them; and the others of the
/// caller's.
std::vector<Card> common_cards(const std::vector<Card>& given);
std::vector<Card> without_common_cards(const std::vector<Card>& cards);

/// Appends WAVELENn and the cards of the planes [first, first + count) of one HDU, numbered where
/// they are several.
void append_plane_cards(std::vector<Card>& cards, const ImageHeader& header, int first, int count);

/// Appends a card to the current header, see card_records().
void write_card(FitsFile& file, const Card& card);

/// write_card() for all, and the LONGSTRN card that announces continued strings where there are.
void write_cards(FitsFile& file, const std::vector<Card>& cards);

/// The current header's records, as they are.
std::vector<std::string> read_records(FitsFile& file);

/// The current header's cards, without those that describe the data's layout, compression and
/// checksums.
std::vector<Card> read_cards(FitsFile& file);

/// Writes DATASUM and CHECKSUM with comments that do not tell the time, so that equal files have
/// equal bytes. `data_sum` is that of the HDU's data where the caller knows it: otherwise they are
/// read again.
void write_checksum(FitsFile& file, std::optional<std::uint32_t> data_sum = std::nullopt);
/// Makes room for them, where the header must not grow later.
void reserve_checksum(FitsFile& file);

/// Cells of a column of texts, as they stand there but without blanks at the end; rows from 1.
std::vector<std::string> read_text_cells(FitsFile& file, int column, LONGLONG first,
                                         LONGLONG count);

/// A new binary table HDU after the last one; `common` cards come first. See gamer/image/fits.h for
/// the format.
void write_text_table(FitsFile& file, const TextTable& table, const std::vector<Card>& common);

/// Whether the current HDU is a table that write_text_table() made.
bool is_text_table(FitsFile& file);
TextTable read_text_table(FitsFile& file);

/// Names of the cards that every HDU carries and that are no part of a TextTable: DATE, ORIGIN,
/// CREATOR.
bool is_common_card(std::string_view key);

}  // namespace gamer
