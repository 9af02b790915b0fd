#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "gamer/core/error.h"
#include "gamer/image/fits/fits_stream.h"
#include "gamer/processing/operation.h"
#include "image/image_test_util.h"

namespace gamer {

/// One image HDU with planes of 4 x 2 pixels.
struct SmallHdu {
  static constexpr int width = 4, height = 2;

  std::vector<std::vector<double>> planes;
  std::vector<Card> cards;
};

inline std::vector<double> even(double value) {
  return std::vector<double>(static_cast<std::size_t>(SmallHdu::width) * SmallHdu::height, value);
}

/// Runs operations on small files in a temporary folder.
class SmallFiles : public testing::Test {
 protected:
  void write(const std::string& name, const std::vector<SmallHdu>& hdus) const {
    FitsOutput output({(folder_ / name).string(), true});
    for (const SmallHdu& hdu : hdus) {
      FitsHeader header;
      for (const Card& card : hdu.cards) header.set(card);
      std::vector<PlanePtr> planes;
      for (const auto& values : hdu.planes) {
        planes.push_back(std::make_shared<MemoryPlane>(SmallHdu::width, SmallHdu::height, values));
      }
      output.write(header, planes, -64, 1);
    }
    output.finish();
  }

  /// Runs an operation: its name, then options and files. Words with ".fits" are files of the
  /// folder.
  void run(std::vector<std::string> words) const {
    const Operation& operation = find_operation(words.front());
    words.erase(words.begin());
    for (std::string& word : words) {
      if (word.find(".fits") != std::string::npos) word = (folder_ / word).string();
    }
    words.emplace_back("--overwrite");
    EXPECT_EQ(operation.run(parse_call(operation, words)), 0);
  }

  /// The error's message without the folder's name; "none" if the operation ran.
  std::string error(const std::vector<std::string>& words) const {
    try {
      run(words);
    } catch (const InputError& error) {
      std::string text = error.what();
      const std::string own = folder_.path().string() + "/";
      for (std::size_t at; (at = text.find(own)) != std::string::npos;) text.erase(at, own.size());
      return text;
    }
    return "none";
  }

  FitsInput file(const std::string& name = "out.fits") const {
    return FitsInput((folder_ / name).string());
  }

  static double pixel(const FitsInput& file, std::size_t hdu, int plane, int x = 1, int y = 1) {
    return evaluate(*file.plane(hdu, plane)).at(x, y);
  }

  TemporaryFolder folder_;
};

}  // namespace gamer
