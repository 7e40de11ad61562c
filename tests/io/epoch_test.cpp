// SPDX-License-Identifier: Apache-2.0
#include "io/epoch.hpp"

#include <gtest/gtest.h>

#include "trammel/core/error.hpp"

namespace {

using namespace trammel::io;

double between(const char* from, const char* to, TimeScale scale = TimeScale::kUtc) {
  return seconds_between(parse_epoch(from, "a"), parse_epoch(to, "b"), scale);
}

TEST(Epoch, CalendarAndOrdinalFormsAgree) {
  EXPECT_EQ(between("2005-06-08T17:41:00", "2005-159T17:41:00Z"), 0.0);
  EXPECT_EQ(between("2004-12-31T00:00:00", "2004-366T00:00:00"), 0.0);
  EXPECT_EQ(between("1970-01-01T00:00:00", "1970-001T01:02:03.25"), 3723.25);
  EXPECT_EQ(between("2024-02-28T23:59:59.9", "2024-03-01T00:00:00.1", TimeScale::kUniform), 86400.2);
}

TEST(Epoch, DecimalFractionsComeBackExactly) {
  const Epoch start = parse_epoch("2018-07-23T12:07:04", "start");
  for (const double t : {0.1, 4.1, 1234.567, 86399.999, -0.25, 100000.000000001}) {
    const std::string text = format_epoch(advance(start, t, TimeScale::kUtc));
    EXPECT_EQ(seconds_between(start, parse_epoch(text, "t"), TimeScale::kUtc), t) << text;
  }
  EXPECT_EQ(format_epoch(advance(start, 0.5, TimeScale::kUtc)), "2018-07-23T12:07:04.5");
  EXPECT_EQ(format_epoch(start), "2018-07-23T12:07:04");
  EXPECT_EQ(format_epoch(parse_epoch("2018-12-31T23:59:59.9999999996", "t")), "2019-01-01T00:00:00");
}

TEST(Epoch, LeapSecondsAreCountedInUtcOnly) {
  EXPECT_EQ(between("2016-12-31T23:59:59", "2017-01-01T00:00:00"), 2.0);
  EXPECT_EQ(between("2016-12-31T23:59:59", "2017-01-01T00:00:00", TimeScale::kUniform), 1.0);
  EXPECT_EQ(between("2016-12-31T23:59:59", "2016-12-31T23:59:60.5"), 1.5);
  EXPECT_EQ(between("1972-01-01T00:00:00", "2017-01-01T00:00:00") -
                between("1972-01-01T00:00:00", "2017-01-01T00:00:00", TimeScale::kUniform),
            27.0);
  const Epoch before = parse_epoch("2016-12-31T23:59:59", "t");
  EXPECT_EQ(format_epoch(advance(before, 1.25, TimeScale::kUtc)), "2016-12-31T23:59:60.25");
  EXPECT_EQ(format_epoch(advance(before, 2.0, TimeScale::kUtc)), "2017-01-01T00:00:00");
}

TEST(Epoch, WhatIsNoEpochIsAnError) {
  for (const char* text :
       {"", "2005", "2005-13-01T00:00:00", "2005-02-29T00:00:00", "2005-366T00:00:00", "2005-000T00:00:00",
        "2005-01-01 00:00:00", "2005-01-01T24:00:00", "2005-01-01T00:60:00", "2005-01-01T00:00:60",
        "2005-01-01T00:00:00.", "2005-01-01T00:00:00X", "2005-01-01T00:00", "05-01-01T00:00:00",
        "2005-01-01T00:00:00ZZ", "0000-01-01T00:00:00", "2005-1-01T00:00:00"}) {
    EXPECT_THROW((void)parse_epoch(text, "here"), trammel::Error) << text;
  }
  EXPECT_THROW((void)advance(Epoch{}, 1e300, TimeScale::kUtc), trammel::Error);
}

}  // namespace
