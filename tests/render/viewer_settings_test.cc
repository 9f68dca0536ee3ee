// What a user, a script or a budget sets in the viewer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "render/radiance/setting_options.h"
#include "render/viewer/motion_budget.h"
#include "render/viewer/remembered.h"
#include "render/viewer/script.h"
#include "render/viewer/setting_rules.h"
#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using testing::HasSubstr;

TEST(Script, ReadsStatements) {
  const auto steps =
      ParseScript(" jump 3; orbit 10 -2.5 ;\n wait; wait 0.5; k all; show false-color; screenshot a b.png;;");
  ASSERT_EQ(steps.size(), 7U);
  EXPECT_EQ(steps[0].verb, ScriptVerb::kJump);
  EXPECT_EQ(steps[0].word, "3");
  EXPECT_EQ(steps[1].numbers, (std::vector<double>{10, -2.5}));
  EXPECT_TRUE(steps[2].numbers.empty());
  EXPECT_EQ(steps[3].numbers, (std::vector<double>{0.5}));
  EXPECT_EQ(steps[6].word, "a b.png");
  EXPECT_TRUE(ParseScript(" ;\n").empty());
}

TEST(Script, NamesTheStatementThatIsWrong) {
  for (const char* bad : {"dance",
                          "orbit 10",
                          "orbit 10 20 30",
                          "orbit a b",
                          "k 0",
                          "k 17",
                          "k 1.5",
                          "dolly 0",
                          "zoom -1",
                          "frusta maybe",
                          "show red",
                          "jump",
                          "wait -1",
                          "move 1 2",
                          "orbit 1 nan",
                          "screenshot",
                          "set k",
                          "set colour red",
                          "set k 99",
                          "set resolution sharp",
                          "effects magic",
                          "effects fov,magic",
                          "key-update",
                          "key-update 1.5",
                          "key-time 0 -1",
                          "path-size 8 8",
                          "path-fps 0",
                          "path-seconds 0",
                          "budget 0.1",
                          "panel perhaps",
                          "play 3",
                          "record",
                          "time now"}) {
    try {
      ParseScript(std::string("wait; ") + bad + "; home");
      ADD_FAILURE() << bad << " was accepted";
    } catch (const UsageError& e) {
      EXPECT_THAT(std::string(e.what()), HasSubstr(std::string("'") + bad + "'"));
    }
  }
}

TEST(Script, SetTakesEveryOptionOfTheReconstruction) {
  const auto steps =
      ParseScript("set k 7; set resolution-range 0.5,4; effects fov,time; key-add; key-add 3; record a b.mp4");
  ASSERT_EQ(steps.size(), 6U);
  EXPECT_EQ(steps[0].word, "k");
  EXPECT_EQ(steps[0].value, "7");
  EXPECT_EQ(steps[1].value, "0.5,4");
  EXPECT_EQ(steps[5].word, "a b.mp4");
  for (const SettingOption& o : SettingOptions()) {
    const auto again = ParseScript("set " + o.name + " " + o.fallback);
    ASSERT_EQ(again.size(), 1U);
    EXPECT_EQ(again[0].word, o.name);
  }
}

// Whatever a user changes, in whatever order: the settings stay ones that are drawn.
TEST(SettingRules, ChangesFromThePanelNeverMakeAnInvalidCombination) {
  RadianceSettings s;
  std::mt19937_64 random(11);
  const std::vector<std::pair<std::string, std::vector<std::string>>> moves = {
      {"similarity", {"identity", "full"}},
      {"correlation", {"inverse", "falling-leaves", "measured"}},
      {"grid", {"pixel", "25x25", "2x9"}},
      {"sampling", {"candidates", "interpolated"}},
      {"r-min-deg", {"0", "3", "50"}},
      {"r-max-deg", {"0.01", "5", "90"}},
      {"k", {"1", "16", "all"}},
      {"resolution", {"off", "jacobian"}},
      {"method", {"ulr", "ulr", "heigl-1999", "wood-2000"}},
      {"time", {"on", "off"}}};
  int full = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto& [name, values] = moves[random() % moves.size()];
    SetOption(s, name, values[random() % values.size()]);
    Reconcile(s, name);
    ASSERT_EQ(Validate(s), "") << "after " << name << " in step " << i;
    ASSERT_NE(s.correlation, Correlation::kMeasured);
    full += s.similarity == Similarity::kFull ? 1 : 0;
  }
  EXPECT_GT(full, 100);  // it is not that the optimum was never reached
}

TEST(SettingRules, AnOptionSaysWhyItHasNoEffect) {
  RadianceSettings s;
  EXPECT_EQ(WhyWithoutEffect(s, "k"), "");
  EXPECT_NE(WhyWithoutEffect(s, "cutoff-deg"), "");
  EXPECT_NE(WhyWithoutEffect(s, "epipoles"), "");
  EXPECT_NE(WhyWithoutEffect(s, "beta"), "");
  s.similarity = Similarity::kFull;
  Reconcile(s, "similarity");
  EXPECT_EQ(WhyWithoutEffect(s, "k"), "") << "its local mean is over the k nearest";
  EXPECT_EQ(WhyWithoutEffect(s, "cutoff-deg"), "");
  EXPECT_EQ(WhyWithoutEffect(s, "r-min-deg"), "");
  s.grid_columns = s.grid_rows = 25;
  EXPECT_EQ(WhyWithoutEffect(s, "epipoles"), "");
}

// Frame times are simulated: what a setting costs on some machine, times a load that changes.
class Budget : public testing::Test {
 protected:
  static double Cost(const RadianceSettings& s) {
    return !s.Sparse() ? 90 : s.sampling == Sampling::kInterpolated ? 8.0 * s.k : 14.0 + 3.0 * s.k;
  }
  static void ProbeAll(MotionBudget& budget) {
    while (const RadianceSettings* s = budget.ToProbe()) budget.Probed(Cost(*s));
  }
  const FrontKey nowhere_{"none", "gl", "a machine", 640, 480};
};

TEST_F(Budget, AMovingCameraGetsWhatFitsAndARestingOneTheUsersSettings) {
  RadianceSettings base;
  base.visibility = false;
  base.k = 7;  // no setting that is probed
  MotionBudget budget;
  EXPECT_FALSE(budget.active());
  budget.Begin(40, "/nonexistent", nowhere_, base);
  ASSERT_NE(budget.ToProbe(), nullptr);
  EXPECT_EQ(budget.Next(0, true, base), base);  // nothing is known yet
  ProbeAll(budget);
  double now = 0, slowest = 0;
  for (int i = 0; i < 100; ++i, now += 0.04) {
    const RadianceSettings s = budget.Next(now, true, base);
    EXPECT_FALSE(s.visibility);  // what a user switched off stays off
    EXPECT_EQ(Validate(s), "");
    slowest = std::max(slowest, Cost(s));
    budget.Measured(Cost(s));
  }
  EXPECT_LE(slowest, 40);
  EXPECT_GT(slowest, 15);  // nor is the time left unused
  // The machine becomes slower by half: within frames it fits again, as far as anything does.
  double last = 0;
  for (int i = 0; i < 60; ++i, now += 0.04) {
    last = 1.5 * Cost(budget.Next(now, true, base));
    budget.Measured(last);
  }
  EXPECT_LE(last, 40 * 1.15);
  EXPECT_EQ(budget.Next(now + 1, false, base), base);
  budget.End();
  EXPECT_EQ(budget.Next(now + 2, true, base), base);
}

TEST_F(Budget, WhatTheBackendRefusesIsPassedOver) {
  MotionBudget budget;
  budget.Begin(40, "/nonexistent", nowhere_, {});
  while (const RadianceSettings* s = budget.ToProbe())
    budget.Probed(s->sampling == Sampling::kInterpolated ? std::nullopt : std::optional(Cost(*s)));
  for (int i = 0; i < 20; ++i) {
    const RadianceSettings s = budget.Next(0.04 * i, true, {});
    EXPECT_EQ(s.sampling, Sampling::kCandidates);
    budget.Measured(Cost(s));
  }
  MotionBudget none;
  none.Begin(40, "/nonexistent", nowhere_, {});
  while (none.ToProbe() != nullptr) none.Probed(std::nullopt);
  EXPECT_EQ(none.Next(0, true, {}), RadianceSettings{});
}

TEST(Remembered, ComesBackAsItWasKept) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "new" / "view.json";
  EXPECT_EQ(Remember(file).width_px, Remembered().width_px);
  Keep({900, 700, false}, file);
  const Remembered again = Remember(file);
  EXPECT_EQ(again.width_px, 900);
  EXPECT_EQ(again.height_px, 700);
  EXPECT_FALSE(again.panel);
}

TEST(Remembered, WhatCannotBeUsedIsAsByDefault) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "view.json";
  for (const char* text :
       {"", "{", "[]", "{\"width\": 3, \"height\": 700}", "{\"width\": 1e9}", "{\"width\": \"x\"}"}) {
    WriteTextAtomically(file, text);
    EXPECT_EQ(Remember(file).width_px, Remembered().width_px) << text;
    EXPECT_TRUE(Remember(file).panel) << text;
  }
  EXPECT_EQ(Remember({}).height_px, Remembered().height_px);
  Keep({}, folder.path() / "view.json" / "below a file");  // nobody's loss
  Keep({}, {});
}

}  // namespace
}  // namespace lumi
