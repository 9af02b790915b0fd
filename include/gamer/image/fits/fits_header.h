#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/image/fits/card.h"

namespace gamer {

/// The header of one image HDU as 80-character records. Records that nobody changes keep their text
/// and order. Cards of the data's layout (SIMPLE, NAXISn, BSCALE, compression, checksums...) are
/// left out.
///
/// Keys are standard keywords ("CRPIX1") or the words after HIERARCH; case does not matter. Values
/// of long strings include their CONTINUE records.
class FitsHeader {
 public:
  FitsHeader() = default;
  explicit FitsHeader(std::vector<std::string> records);

  const std::vector<std::string>& records() const { return records_; }

  bool has(std::string_view key) const;
  /// The value as a number; nothing without such a card, or where the value is not a number.
  std::optional<double> number(std::string_view key) const;
  /// The value as a string without quotes; numbers as written in the card.
  std::optional<std::string> text(std::string_view key) const;
  /// The whole card; nothing where there is none.
  std::optional<Card> card(std::string_view key) const;

  /// Replaces the card's value in its place, or appends the card; an empty new comment keeps the
  /// old one. COMMENT and HISTORY (monostate) are always appended, over several records if long.
  /// Throws InputError for a key or value that FITS cannot hold, or a key of the data's layout.
  void set(const Card& card);
  void set(const std::string& key, double value) { set({key, value, {}}); }
  void set(const std::string& key, const std::string& value) { set({key, value, {}}); }
  /// Sets a card that must stand before all others (WCSAXES before the axes it counts).
  void set_first(const Card& card);
  /// Removes all cards of that key, also all lines of COMMENT. Returns whether there was one.
  bool remove(std::string_view key);
  /// Removes the world coordinates of axes 3 and up, and the card that counts more than two axes.
  void remove_further_axes();
  /// Appends records of 80 characters unchanged.
  void append(const std::vector<std::string>& records);

  /// A record's key in capitals, without HIERARCH; "" for blank lines and CONTINUE.
  static std::string key_of(std::string_view record);
  /// Whether a card of that key describes the data's layout, and so is not in a FitsHeader.
  static bool is_structural(std::string_view key);

 private:
  std::optional<std::size_t> find(std::string_view key) const;
  /// Number of records from `first` that form its card: 1 and the CONTINUEs.
  std::size_t length(std::size_t first) const;

  std::vector<std::string> records_;
};

}  // namespace gamer
