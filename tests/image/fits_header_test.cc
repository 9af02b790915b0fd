#include "gamer/image/fits/fits_header.h"

#include <gtest/gtest.h>

#include <limits>

#include "gamer/core/error.h"

namespace gamer::fits_header_test {
namespace {

FitsHeader sample() {
  return FitsHeader({
      "BUNIT   = 'nJy     '           / unit of the pixels",
      "MAGZERO =                 31.4 / AB magnitude of 1 unit per pixel",
      "HIERARCH GAMER IMAGE SIZE = '[64, 64]' / [pixels]",
      "COMMENT first",
      "LONGTEXT= 'a text that is far too long for one card, and so is continued on&'",
      "CONTINUE  ' the next one' / comment",
      "COUNT   =                    3",
      "COMMENT second",
      "FLAG    =                    T",
  });
}

TEST(FitsHeader, Values) {
  const FitsHeader header = sample();
  EXPECT_EQ(header.text("BUNIT"), "nJy");
  EXPECT_EQ(header.text("bunit"), "nJy");
  EXPECT_EQ(header.number("MAGZERO"), 31.4);
  EXPECT_EQ(header.number("COUNT"), 3);
  EXPECT_EQ(header.text("GAMER IMAGE SIZE"), "[64, 64]");
  EXPECT_EQ(header.text("HIERARCH GAMER IMAGE SIZE"), "[64, 64]");
  EXPECT_EQ(header.text("LONGTEXT"),
            "a text that is far too long for one card, and so is continued on the next one");
  EXPECT_EQ(header.text("FLAG"), "T");
  EXPECT_FALSE(header.number("BUNIT"));
  EXPECT_FALSE(header.text("NOTHING"));
  EXPECT_EQ(header.card("MAGZERO")->comment, "AB magnitude of 1 unit per pixel");
}

TEST(FitsHeader, SetKeepsPlaceAndComment) {
  FitsHeader header = sample();
  header.set("MAGZERO", 23.9);
  EXPECT_EQ(header.records()[1].substr(0, 39), "MAGZERO =                 23.9 / AB mag");
  header.set({"MAGZERO", 8.9, "new"});
  EXPECT_EQ(header.card("MAGZERO")->comment, "new");
  header.set("LONGTEXT", std::string("short"));
  EXPECT_EQ(header.records().size(), 8u);
  EXPECT_EQ(header.text("COUNT"), "3");
  header.set("COUNT", std::string(150, 'x'));
  EXPECT_EQ(header.text("COUNT"), std::string(150, 'x'));
  EXPECT_EQ(header.text("FLAG"), "T");
  for (const std::string& record : header.records()) EXPECT_EQ(record.size(), 80u);
}

TEST(FitsHeader, NewCards) {
  FitsHeader header = sample();
  header.set("NEW", 1e-30);
  header.set({"a longer name", 5LL, "c"});
  EXPECT_EQ(header.number("NEW"), 1e-30);
  EXPECT_EQ(header.number("A LONGER NAME"), 5);
  EXPECT_TRUE(header.records().back().starts_with("HIERARCH A LONGER NAME = 5 / c"));
  header.set({"HISTORY", {}, std::string(100, 'h')});
  const auto& records = header.records();
  EXPECT_EQ(records[records.size() - 2], "HISTORY " + std::string(72, 'h'));
  EXPECT_EQ(records.back().substr(0, 37), "HISTORY " + std::string(28, 'h') + " ");
}

TEST(FitsHeader, SetFirst) {
  FitsHeader header = sample();
  header.set_first({"COUNT", 4LL, {}});
  EXPECT_EQ(header.records().size(), sample().records().size());
  EXPECT_TRUE(header.records()[0].starts_with("COUNT   =                    4"));
}

TEST(FitsHeader, Remove) {
  FitsHeader header = sample();
  EXPECT_TRUE(header.remove("LONGTEXT"));
  EXPECT_TRUE(header.remove("COMMENT"));
  EXPECT_FALSE(header.remove("COMMENT"));
  EXPECT_EQ(header.records().size(), 5u);
  EXPECT_EQ(header.text("FLAG"), "T");
}

TEST(FitsHeader, WhatCannotBeSet) {
  FitsHeader header;
  for (const char* key : {"NAXIS1", "naxis", "BITPIX", "SIMPLE", "END", "CHECKSUM", "BSCALE", "",
                          "A=B", "ZTILE1", "TFORM1"}) {
    EXPECT_THROW(header.set(key, 1.0), InputError) << key;
  }
  EXPECT_THROW(header.set("X", std::numeric_limits<double>::infinity()), InputError);
  EXPECT_TRUE(header.records().empty());
}

TEST(FitsHeader, ThirdAxis) {
  FitsHeader header({"WCSAXES =                    3", "CTYPE1  = 'RA---TAN'",
                     "CTYPE3  = 'WAVE-TAB'", "CD1_1   = 1.0", "CD3_3   = 1.0", "CD1_3   = 0.0",
                     "PS3_0   = 'WCS-TABLE'", "CRVAL3A = 3.0"});
  header.remove_further_axes();
  EXPECT_EQ(header.records().size(), 3u);
  EXPECT_EQ(header.number("WCSAXES"), 2);
  EXPECT_TRUE(header.has("CD1_1"));
}

}  // namespace
}  // namespace gamer::fits_header_test
