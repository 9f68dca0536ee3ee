#include "pipeline/stabilize/window_object.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/program/error.h"

namespace lumi {
namespace {

using testing::ElementsAre;
using testing::Optional;

TEST(WindowObject, AFrameOfTheFilmIsCountedFromTheWindowsFirst) {
  const std::vector<std::string> given{"--object", "1,2,3,4", "--object-frame", "250", "--cutoff-hz", "1"};
  EXPECT_THAT(ObjectArguments(given, 240, 479, false),
              Optional(ElementsAre("--object", "1,2,3,4", "--cutoff-hz", "1", "--object-frame", "10")));
  EXPECT_THAT(ObjectArguments(given, 250, 250, false),
              Optional(ElementsAre("--object", "1,2,3,4", "--cutoff-hz", "1", "--object-frame", "0")));
  EXPECT_EQ(ObjectArguments(given, 0, 249, false), std::nullopt);
  // After a cut the box would be of something else.
  EXPECT_EQ(ObjectArguments(given, 251, 400, false), std::nullopt);
  // A window that goes on from one with the object takes it from there.
  EXPECT_THAT(ObjectArguments(given, 251, 400, true), Optional(ElementsAre("--object", "1,2,3,4", "--cutoff-hz", "1")));
}

TEST(WindowObject, WithoutAFrameTheObjectIsInTheFilmsFirst) {
  const std::vector<std::string> given{"--object-point", "8,9"};
  EXPECT_THAT(ObjectArguments(given, 0, 99, false),
              Optional(ElementsAre("--object-point", "8,9", "--object-frame", "0")));
  EXPECT_EQ(ObjectArguments(given, 100, 199, false), std::nullopt);
  const std::vector<std::string> wrong{"--object-frame", "x"};
  EXPECT_THAT(ObjectArguments(wrong, 100, 199, false), Optional(wrong));
}

TEST(WindowObject, AFrameThatTheFilmDoesNotHaveIsRefused) {
  EXPECT_NO_THROW(RequireObjectFrame({"--object-frame", "9"}, 10));
  EXPECT_THROW(RequireObjectFrame({"--object-frame", "10"}, 10), UsageError);
  EXPECT_NO_THROW(RequireObjectFrame({"--object", "1,2,3,4"}, 10));
}

}  // namespace
}  // namespace lumi
