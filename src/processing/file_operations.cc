#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/text.h"
#include "gamer/core/capitals.h"
#include "gamer/core/near.h"
#include "gamer/core/printable.h"
#include "image/fits/card_record.h"
#include "processing/operation_groups.h"
#include "processing/plane_operation.h"

namespace gamer {
namespace {

// ---- stack -------------------------------------------------------------------------------------

/// One plane of the inputs, with its own cards.
struct StackedPlane {
  PlanePtr plane;
  PlaneInfo info;
  std::vector<Card> cards;  ///< cards of this plane, with keys without a number
  FitsHeader header;        ///< header of its HDU without these cards
  int bitpix = 0;
  std::string file;
};

/// Takes the cards of plane `plane`, and the header without any plane's cards.
void take_plane_cards(const FitsHdu& hdu, int plane, StackedPlane& out) {
  FitsHeader header = hdu.header;
  for (const std::string_view key : plane_keys()) {
    const auto get = [&](const std::string& name) { return header.card(name); };
    if (auto card = of_plane(key, plane, get)) {
      card->key = key;
      out.cards.push_back(*card);
    }
    header.remove(key);
    for (int i = 1; i <= hdu.planes; ++i) header.remove(fmt::format("{}{}", key, i));
  }
  const bool has_wavelength =
      std::ranges::any_of(out.cards, [](const Card& card) { return card.key == "WAVELEN"; });
  if (out.info.wavelength && !has_wavelength) {
    out.cards.push_back({"WAVELEN", *out.info.wavelength, "[Angstrom] wavelength"});
  }
  drop_record(header);
  out.header = std::move(header);
}

std::vector<StackedPlane> read_planes(const OperationCall& call,
                                      const std::vector<FitsInput>& inputs) {
  std::vector<StackedPlane> planes;
  for (const FitsInput& input : inputs) {
    const std::size_t before = planes.size();
    for (std::size_t i = 0; i < input.hdus().size(); ++i) {
      const FitsHdu& hdu = input.hdus()[i];
      for (int plane = 0; plane < hdu.planes; ++plane) {
        const PlaneInfo info = plane_info(input, hdu, plane);
        if (info.role == PlaneRole::variance) continue;
        StackedPlane& next = planes.emplace_back();
        next.plane = input.plane(i, plane);
        next.info = info;
        next.bitpix = output_bitpix(call, hdu);
        next.file = hdu_label(input, hdu);
        take_plane_cards(hdu, plane, next);
      }
    }
    if (planes.size() == before) throw input_error("{}: no image in it", input.name());
  }
  return planes;
}

std::vector<StackedPlane> planes_in_order(const OperationCall& call,
                                          std::vector<StackedPlane> planes) {
  if (call.parameters.has("planes")) {
    std::vector<StackedPlane> chosen;
    for (const double wanted : call.parameters.numbers("planes")) {
      const bool is_there = wanted == std::floor(wanted) && wanted >= 1 &&
                            wanted <= static_cast<double>(planes.size());
      if (!is_there) {
        throw input_error("gutil stack: --planes {}: there are planes 1 to {}", wanted,
                          planes.size());
      }
      chosen.push_back(planes[static_cast<std::size_t>(wanted) - 1]);
    }
    planes = std::move(chosen);
  }
  if (call.parameters.text("order") == "wavelength") {
    for (const StackedPlane& plane : planes) {
      if (plane.info.wavelength) continue;
      throw input_error(
          "gutil stack: {} has no WAVELEN card and no axis of wavelengths to order its planes by; "
          "see gutil header",
          plane.file);
    }
    std::ranges::stable_sort(planes, [](const auto& a, const auto& b) {
      return *a.info.wavelength < *b.info.wavelength;
    });
  }
  return planes;
}

void check_planes_fit(const std::vector<StackedPlane>& planes, bool one_unit) {
  const StackedPlane& first = planes.front();
  for (const StackedPlane& other : planes) {
    if (other.plane->width() != first.plane->width() ||
        other.plane->height() != first.plane->height()) {
      throw input_error(
          "gutil stack: {} has {} x {} pixels, {} has {} x {}; a cube has planes of one size",
          other.file, other.plane->width(), other.plane->height(), first.file, first.plane->width(),
          first.plane->height());
    }
    if (one_unit && other.info.unit != first.info.unit) {
      throw input_error(
          "gutil stack: the pixels of {} are in '{}', those of {} in '{}'; a cube has one unit",
          other.file, other.info.unit, first.file, first.info.unit);
    }
  }
}

/// A plane's label for file names: letters, digits and -_.+, unique among `taken`.
std::string file_label(const PlaneInfo& info, std::size_t number, std::set<std::string>& taken) {
  std::string label = info.label.empty() ? fmt::format("{}", number) : info.label;
  for (char& c : label) {
    const bool is_mark = std::string_view("-_.+").find(c) != std::string_view::npos;
    if (!is_letter_or_digit(c) && !is_mark) c = '_';
  }
  if (!taken.insert(label).second) {
    label += fmt::format("_{}", number);
    taken.insert(label);
  }
  return label;
}

/// Header of an HDU with that plane alone.
FitsHeader single_header(const OperationCall& call, const StackedPlane& plane) {
  FitsHeader header = plane.header;
  header.remove_further_axes();
  for (Card card : plane.cards) {
    // The renderer numbers WAVELENn in every HDU.
    if (card.key == "WAVELEN") card.key += "1";
    header.set(card);
  }
  header.set({"HISTORY", {}, call.history});
  return header;
}

/// Copies HDUs without pixels. The record is left out, and so is the table of a third axis, which
/// is made anew.
void copy_tables(const FitsInput& input, FitsOutput& output) {
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    const FitsHdu& hdu = input.hdus()[i];
    const bool is_kept = !is_record(hdu) && hdu.name != "WCS-TABLE";
    if (!hdu.is_image() && i > 0 && is_kept) output.copy(input, i);
  }
}

void write_stacked_cube(const OperationCall& call, const std::vector<StackedPlane>& planes,
                        FitsOutput& output) {
  FitsHeader header = planes.front().header;
  header.remove("EXTNAME");
  std::vector<PlanePtr> pixels;
  std::vector<double> wavelengths;
  int bitpix = planes.front().bitpix;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    pixels.push_back(planes[i].plane);
    bitpix = std::min(bitpix, planes[i].bitpix);
    if (planes[i].info.wavelength) wavelengths.push_back(*planes[i].info.wavelength);
    for (Card card : planes[i].cards) {
      if (card.key == "WAVELEN") continue;
      if (planes.size() > 1) card.key += fmt::format("{}", i + 1);
      header.set(card);
    }
  }
  if (wavelengths.size() != planes.size()) wavelengths.clear();
  header.set({"HISTORY", {}, call.history});
  output.write_cube(header, pixels, wavelengths, bitpix, call.threads);
}

int stack_files(const OperationCall& call) {
  const std::vector<FitsInput> inputs(call.inputs.begin(), call.inputs.end());
  const std::vector<StackedPlane> planes = planes_in_order(call, read_planes(call, inputs));
  const std::string& layout = call.parameters.text("layout");
  if (layout == "cube") {
    check_planes_fit(planes, true);
    FitsOutput output({call.output, call.overwrite});
    write_stacked_cube(call, planes, output);
    copy_tables(inputs.front(), output);
    output.finish();
    return 0;
  }
  std::set<std::string> labels;
  if (layout == "extensions") {
    FitsOutput output({call.output, call.overwrite});
    output.write_empty({});
    for (std::size_t i = 0; i < planes.size(); ++i) {
      FitsHeader header = single_header(call, planes[i]);
      header.set("EXTNAME", file_label(planes[i].info, i + 1, labels));
      output.write(header, {planes[i].plane}, planes[i].bitpix, call.threads);
    }
    copy_tables(inputs.front(), output);
    output.finish();
    return 0;
  }
  // Files get their final names when all are complete.
  if (call.output == "-") {
    throw InputError("gutil stack: --layout files needs a name: out.fits makes out_<label>.fits");
  }
  std::vector<std::unique_ptr<FitsOutput>> outputs;
  const std::filesystem::path path = call.output;
  std::string stem = path.filename().string();
  std::string suffix;
  for (const char* known : {".fits.fz", ".fits"}) {
    if (suffix.empty() && stem.ends_with(known)) suffix = known;
  }
  stem.resize(stem.size() - suffix.size());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const std::string label = file_label(planes[i].info, i + 1, labels);
    const auto name = path.parent_path() / fmt::format("{}_{}{}", stem, label, suffix);
    outputs.push_back(
        std::make_unique<FitsOutput>(FitsOutputOptions{name.string(), call.overwrite}));
    outputs.back()->write(single_header(call, planes[i]), {planes[i].plane}, planes[i].bitpix,
                          call.threads);
    copy_tables(inputs.front(), *outputs.back());
  }
  for (const auto& output : outputs) output->complete();
  for (const auto& output : outputs) output->finish();
  return 0;
}

// ---- header ------------------------------------------------------------------------------------

/// Throws InputError, beginning with `option`, for a key that no card of a FITS file can have.
void check_key(const std::string& option, const std::string& key) {
  constexpr std::size_t standard_length = 8;
  constexpr std::string_view standard = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";
  constexpr std::string_view long_key = "HIERARCH ";
  std::string name = in_capitals(key);
  if (name.starts_with(long_key)) name = trimmed(name.substr(long_key.size()));
  const bool is_reserved = name == "CONTINUE" || name == "HIERARCH";
  const bool is_odd =
      name.size() <= standard_length && name.find_first_not_of(standard) != std::string::npos;
  if (!is_reserved && !is_odd) return;
  throw input_error("gutil header: {}: {} cannot name a card; up to 8 letters, digits, - and _ can",
                    option, in_quotes(key));
}

/// A value in quotes (two quotes within it mean one) and the text after it; nothing for other
/// texts.
std::optional<std::pair<std::string, std::string>> parse_quoted(const std::string& text) {
  if (!text.starts_with('\'')) return std::nullopt;
  std::string value;
  for (std::size_t i = 1; i < text.size(); ++i) {
    if (text[i] == '\'') {
      if (i + 1 == text.size() || text[i + 1] != '\'') {
        const std::string rest(trimmed(text.substr(i + 1)));
        if (!rest.empty() && !rest.starts_with('/')) return std::nullopt;
        return std::pair(value, rest.empty() ? "" : std::string(trimmed(rest.substr(1))));
      }
      ++i;
    }
    value += text[i];
  }
  return std::nullopt;
}

/// Parses "KEY=value / comment". Numbers, T and F are read as in FITS, other values are strings.
/// COMMENT and HISTORY are texts as a whole.
Card parse_setting(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw input_error("gutil header: --set {}: expected KEY=value or KEY=value / comment",
                      in_quotes(text));
  }
  Card card;
  card.key = trimmed(text.substr(0, equals));
  check_key("--set " + in_quotes(text), card.key);
  std::string value(trimmed(text.substr(equals + 1)));
  if (const std::string key = in_capitals(card.key); key == "COMMENT" || key == "HISTORY") {
    card.comment = value;
    return card;
  }
  if (const auto quoted = parse_quoted(value)) {
    card.value = quoted->first;
    card.comment = quoted->second;
    return card;
  }
  if (const std::size_t slash = value.find(" / "); slash != std::string::npos) {
    card.comment = trimmed(value.substr(slash + 3));
    value = trimmed(value.substr(0, slash));
  }
  if (const auto whole = number_of<long long>(value)) {
    card.value = *whole;
  } else if (const auto real = number_of<double>(value)) {
    card.value = *real;
  } else if (value == "T" || value == "F") {
    card.value = value == "T";
  } else {
    card.value = value;
  }
  return card;
}

void edit_header(const OperationCall& call, const FitsInput& input,
                 const std::optional<FitsInput>& source, FitsHeader& header) {
  const ParameterSet& parameters = call.parameters;
  for (const std::string& key : parameters.texts("delete")) {
    if (!header.remove(key)) {
      throw input_error("gutil header: --delete {}: {} has no such card", key, input.name());
    }
  }
  for (const std::string& text : parameters.texts("set")) header.set(parse_setting(text));
  for (const std::string& key : parameters.texts("copy")) {
    const std::size_t first = chosen_hdus("header", *source, "first").front();
    const std::optional<Card> card = source->hdus()[first].header.card(key);
    if (!card) {
      throw input_error("gutil header: --copy {}: {} has no such card", key, source->name());
    }
    check_key("--copy " + key, key);
    header.set(*card);
  }
  header.set({"HISTORY", {}, call.history});
}

int edit_file(const OperationCall& call) {
  if (call.inputs.size() != 2) {
    throw InputError("gutil header: --set, --delete and --copy need an output: in.fits out.fits");
  }
  const FitsInput input(call.inputs.front());
  std::optional<FitsInput> source;
  if (call.parameters.has("from")) source.emplace(call.parameters.text("from"));
  if (!call.parameters.texts("copy").empty() && !source) {
    throw InputError("gutil header: --copy needs --from, the file that has the cards");
  }
  const std::vector<std::size_t> chosen =
      chosen_hdus(call.operation, input, call.parameters.text("hdu"));
  FitsOutput output({call.inputs.back(), call.overwrite});
  for (std::size_t i = 0; i < input.hdus().size(); ++i) {
    if (std::ranges::find(chosen, i) == chosen.end()) {
      output.copy(input, i);
      continue;
    }
    FitsHeader header = input.hdus()[i].header;
    edit_header(call, input, source, header);
    output.copy(input, i, header);
  }
  output.finish();
  return 0;
}

int show_header(const OperationCall& call) {
  if (call.inputs.size() != 1) {
    throw InputError("gutil header: shows one file; an output goes with --set, --delete or --copy");
  }
  const FitsInput input(call.inputs.front());
  const std::vector<std::size_t> chosen =
      chosen_hdus(call.operation, input, call.parameters.text("hdu"));
  for (const std::size_t i : chosen) {
    const FitsHdu& hdu = input.hdus()[i];
    const std::vector<std::string>& keys = call.parameters.texts("get");
    for (const std::string& key : keys) {
      const auto value = hdu.header.text(key);
      if (!value) {
        throw input_error("gutil header: --get {}: {} has no such card", key,
                          hdu_label(input, hdu));
      }
      call.print(*value + "\n");
    }
    if (!keys.empty()) continue;
    std::string text;
    if (chosen.size() > 1) {
      text = fmt::format("# HDU {}{}{}\n", hdu.number, hdu.name.empty() ? "" : " ", hdu.name);
    }
    for (const std::string& record : hdu.header.records()) {
      text += printable(trim_right(record)) + "\n";
    }
    call.print(text);
  }
  return 0;
}

int run_header(const OperationCall& call) {
  const ParameterSet& parameters = call.parameters;
  const bool edits = !parameters.texts("set").empty() || !parameters.texts("delete").empty() ||
                     !parameters.texts("copy").empty();
  if (parameters.has("from") && parameters.texts("copy").empty()) {
    throw InputError("gutil header: --from goes with --copy, which names the cards");
  }
  if (edits && !parameters.texts("get").empty()) {
    throw InputError(
        "gutil header: --get prints and --set, --delete and --copy write a file; give one of them");
  }
  return edits ? edit_file(call) : show_header(call);
}

Operation stack_operation() {
  return {
      .name = "stack",
      .summary = "Put planes of several files into one, or take a cube apart",
      .description =
          "All planes of all files, in order, become a cube, one extension each, or one file each "
          "(out_<label>.fits). The header is the first file's. WAVELEN, BAND, MAGZERO and other "
          "cards of one plane go with the plane, as KEYn in a cube. Wavelengths come from WAVELEN, "
          "or from an input's third axis where CTYPE3 is WAVE, AWAV, WAVELENGTH or LAMBDA. Evenly "
          "spaced wavelengths are the cube's third axis; otherwise that axis counts the planes. "
          "Tables are the first file's. Its record (INPUTS and the GAMER cards) is left out, "
          "because it describes the first image alone. Variances (EXTNAME VARIANCE, ..._VARIANCE) "
          "are left out.",
      .most_inputs = 0,
      .parameters =
          {
              Parameter::choice("layout", {"cube", "extensions", "files"}, "cube",
                                "layout of the output"),
              Parameter::choice("order", {"given", "wavelength"}, "given", "order of the planes"),
              Parameter::numbers("planes", "", Interval::any(), std::nullopt,
                                 "planes to take, counted from 1 over all files, in this order"),
          },
      .example = "stack --order wavelength in.fits in2.fits out.fits",
      .run = stack_files};
}

Operation header_operation() {
  const std::vector<std::string> none;
  return {
      .name = "header",
      .summary = "Show, set, delete or copy header cards",
      .description =
          "Without --set, --delete and --copy the cards are printed. With any of them a file is "
          "written: gutil header --set OBJECT=M100 in.fits out.fits. Pixels are unchanged.",
      .most_inputs = 2,
      .result = Operation::Result::text,
      .parameters =
          {
              Parameter::text("hdu", "first",
                              "name or number (from 0) of the HDU; first: the first image; all"),
              Parameter::texts("get", none, "print only the value of this card (repeatable)"),
              Parameter::texts("set", none,
                               "KEY=value or KEY=value / comment (repeatable); 'text' in quotes is "
                               "never a number, and '' in it is one quote"),
              Parameter::texts("delete", none, "card to delete (repeatable)"),
              Parameter::texts("copy", none, "card to copy (repeatable)"),
              Parameter::text("from", std::nullopt, "file that --copy copies from"),
          },
      .example = "header --get BUNIT in.fits",
      .run = run_header};
}

}  // namespace

std::vector<Operation> file_operations() { return {stack_operation(), header_operation()}; }

}  // namespace gamer
