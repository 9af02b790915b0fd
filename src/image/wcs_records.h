#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gamer {

/// Number of axes of the sky.
inline constexpr int sky_axis_count = 2;

/// Whether all characters are printing ones of ASCII.
bool is_printing(std::string_view record);
/// Whether the card's value is a string without closing quote.
bool has_open_string(std::string_view record);
/// The records of a header, given as cards of 80 characters or as lines, up to END.
std::vector<std::string> split_records(std::string_view header);
/// The records that describe the celestial axes 1 and 2, or their frame.
std::vector<std::string> celestial_records(const std::vector<std::string>& header);
/// Fails where the records of axes 1 and 2 are not enough: where a further pixel axis moves the
/// position on the sky, or distortions are in tables of other HDUs.
void check_self_contained(const std::vector<std::string>& header, const std::string& label);

/// The record of a card. make_record() writes the value unchanged; the second function puts a text
/// in quotes.
std::string make_record(const std::string& key, const std::string& value,
                        const std::string& comment);
std::string make_text_record(const std::string& key, const std::string& text,
                             const std::string& comment);

}  // namespace gamer
