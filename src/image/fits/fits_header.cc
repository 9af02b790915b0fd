#include "gamer/image/fits/fits_header.h"

#include <regex>
#include <span>
#include <utility>

#include "core/message.h"
#include "gamer/core/capitals.h"
#include "gamer/core/near.h"
#include "image/fits/card_record.h"

namespace gamer {
namespace {

/// The key without HIERARCH, in capitals.
std::string plain_key(std::string_view key) {
  if (key.starts_with(hierarch)) key.remove_prefix(hierarch.size());
  return in_capitals(key);
}

}  // namespace

FitsHeader::FitsHeader(std::vector<std::string> records) : records_(std::move(records)) {
  for (std::string& record : records_) record.resize(record_width, ' ');
}

std::string FitsHeader::key_of(std::string_view record) {
  return is_continuation(record) ? std::string() : record_key(record);
}

bool FitsHeader::is_structural(std::string_view key) {
  return is_layout_record(fmt::format("{:<8}= 1", in_capitals(key)));
}

std::optional<std::size_t> FitsHeader::find(std::string_view key) const {
  const std::string wanted = plain_key(key);
  for (std::size_t i = 0; i < records_.size(); ++i) {
    if (key_of(records_[i]) == wanted) return i;
  }
  return std::nullopt;
}

std::size_t FitsHeader::length(std::size_t first) const {
  return card_length(std::span(records_).subspan(first));
}

bool FitsHeader::has(std::string_view key) const { return find(key).has_value(); }

std::optional<Card> FitsHeader::card(std::string_view key) const {
  const auto first = find(key);
  if (!first) return std::nullopt;
  try {
    return parse_card(std::span(records_).subspan(*first, length(*first)));
  } catch (const CardError&) {
    return std::nullopt;
  }
}

std::optional<double> FitsHeader::number(std::string_view key) const {
  const std::optional<Card> found = card(key);
  if (!found) return std::nullopt;
  if (const auto* real = std::get_if<double>(&found->value)) return *real;
  if (const auto* whole = std::get_if<long long>(&found->value)) return static_cast<double>(*whole);
  return std::nullopt;
}

std::optional<std::string> FitsHeader::text(std::string_view key) const {
  const std::optional<Card> found = card(key);
  if (!found) return std::nullopt;
  struct ToText {
    std::optional<std::string> operator()(std::monostate) const { return std::nullopt; }
    std::optional<std::string> operator()(bool flag) const { return flag ? "T" : "F"; }
    std::optional<std::string> operator()(long long whole) const {
      return fmt::format("{}", whole);
    }
    std::optional<std::string> operator()(double real) const { return fmt::format("{}", real); }
    std::optional<std::string> operator()(const std::string& string) const { return string; }
  };
  return std::visit(ToText(), found->value);
}

void FitsHeader::set(const Card& card) {
  Card wanted = card;
  wanted.key = plain_key(card.key);
  if (wanted.key.empty() || wanted.key == "END" || is_structural(wanted.key)) {
    throw input_error("card {}: describes the file, and cannot be set", in_quotes(card.key));
  }
  const bool is_line = std::holds_alternative<std::monostate>(wanted.value);
  const auto first = is_line ? std::nullopt : find(wanted.key);
  if (first && wanted.comment.empty()) {
    if (const std::optional<Card> old = this->card(wanted.key)) wanted.comment = old->comment;
  }
  std::vector<std::string> records;
  try {
    records = card_records(wanted);
  } catch (const CardError& error) {
    throw InputError(error.what());
  }
  for (std::string& record : records) record.resize(record_width, ' ');
  if (!first) {
    append(records);
    return;
  }
  const auto place = records_.begin() + static_cast<std::ptrdiff_t>(*first);
  const auto next = records_.erase(place, place + static_cast<std::ptrdiff_t>(length(*first)));
  records_.insert(next, records.begin(), records.end());
}

void FitsHeader::set_first(const Card& card) {
  FitsHeader first;
  first.set(card);
  remove(card.key);
  records_.insert(records_.begin(), first.records_.begin(), first.records_.end());
}

bool FitsHeader::remove(std::string_view key) {
  bool found = false;
  while (const auto first = find(key)) {
    const auto place = records_.begin() + static_cast<std::ptrdiff_t>(*first);
    records_.erase(place, place + static_cast<std::ptrdiff_t>(length(*first)));
    found = true;
  }
  return found;
}

void FitsHeader::remove_further_axes() {
  static const std::regex third(
      "(CTYPE|CRPIX|CRVAL|CDELT|CUNIT|CNAME|CROTA|CRDER|CSYER)[3-9][A-Z]?"
      "|(PC|CD)[3-9]_[1-9][A-Z]?|(PC|CD)[12]_[3-9][A-Z]?|(PV|PS)[3-9]_[0-9]+[A-Z]?");
  std::vector<std::string> kept;
  for (std::size_t i = 0; i < records_.size();) {
    const std::size_t count = length(i);
    if (!std::regex_match(key_of(records_[i]), third)) {
      kept.insert(kept.end(), records_.begin() + static_cast<std::ptrdiff_t>(i),
                  records_.begin() + static_cast<std::ptrdiff_t>(i + count));
    }
    i += count;
  }
  records_ = std::move(kept);
  if (has("WCSAXES")) set({"WCSAXES", 2LL, {}});
}

void FitsHeader::append(const std::vector<std::string>& records) {
  for (std::string record : records) {
    record.resize(record_width, ' ');
    records_.push_back(std::move(record));
  }
}

}  // namespace gamer
