#include "scene/geometry/median.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace lumi {
namespace {

TEST(Median, IsTheUpperOfTheTwoInTheMiddle) {
  EXPECT_EQ(Median({3, 1, 2}), 2);
  EXPECT_EQ(Median({4, 1, 3, 2}), 3);
  EXPECT_EQ(Median(std::vector<std::uint8_t>{7}), 7);
  EXPECT_EQ(Median(std::vector<double>{}), 0);
}

TEST(Quantile, IsOneOfTheValues) {
  const std::vector<double> values{5, 3, 1, 4, 2};
  EXPECT_EQ(Quantile(values, 0), 1);
  EXPECT_EQ(Quantile(values, 0.5), 3);
  EXPECT_EQ(Quantile(values, 0.74), 3);  // below the next one's place
  EXPECT_EQ(Quantile(values, 0.75), 4);
  EXPECT_EQ(Quantile(values, 1), 5);
  EXPECT_EQ(Quantile(values, 7), 5);
  EXPECT_EQ(Quantile(std::vector<double>{}, 0.3), 0);
}

}  // namespace
}  // namespace lumi
