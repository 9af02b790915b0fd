#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gamer/image/fits/card.h"

namespace gamer {

/// The header of one image HDU without the cards that describe how its data lie in the file
/// (SIMPLE, NAXISn, BSCALE, compression, checksums...): 80-character records, kept letter by letter
/// and in order where nobody changes them.
///
/// Keys are standard keywords ("CRPIX1") or the words after HIERARCH; upper and lower case are the
/// same. Values of long strings include their CONTINUE records.
class FitsHeader {
 public:
  FitsHeader() = default;
  explicit FitsHeader(std::vector<std::string> records);

  const std::vector<std::string>& records() const { return records_; }

  bool has(std::string_view key) const;
  /// Nothing where there is no such card or its value is no number.
  std::optional<double> number(std::string_view key) const;
  /// The value as a string without quotes; numbers as they stand there.
  std::optional<std::string> text(std::string_view key) const;
  /// The whole card; nothing where there is none.
  std::optional<Card> card(std::string_view key) const;

  /// Replaces the value, and the comment unless the new one is empty, in its place, or appends the
  /// card. COMMENT and HISTORY (value monostate) are always appended, over several records where
  /// they are long. Throws InputError for a key or value that FITS cannot hold, or a key of the
  /// data's layout.
  void set(const Card& card);
  void set(const std::string& key, double value) { set({key, value, {}}); }
  void set(const std::string& key, const std::string& value) { set({key, value, {}}); }
  /// Sets a card that must stand before all others (WCSAXES before the axes it counts).
  void set_first(const Card& card);
  /// Returns whether there was one. All cards of that key go, also the lines of COMMENT.
  bool remove(std::string_view key);
  /// Takes the world coordinates of the third axis and later ones out, and the word that there are
  /// more than two.
  void remove_further_axes();
  /// Appends records as they are: 80 characters each.
  void append(const std::vector<std::string>& records);

  /// Words of a record: its key in capitals, without HIERARCH. "" for blank lines and CONTINUE.
  static std::string key_of(std::string_view record);
  /// Whether a card of that key describes the data's layout, and so is none of ours.
  static bool is_structural(std::string_view key);

 private:
  std::optional<std::size_t> find(std::string_view key) const;
  /// Records from `first` that belong to its card: 1 and the CONTINUEs.
  std::size_t length(std::size_t first) const;

  std::vector<std::string> records_;
};

}  // namespace gamer
