#include "scene/files/json_keys.h"

#include <gtest/gtest.h>

#include <limits>

namespace lumi {
namespace {

struct Leaf {
  std::string name;
  std::optional<double> error_px;
};
void ListKeys(JsonKeys& j, Leaf& l) { j("name", l.name)("error_px", l.error_px); }

struct Tree {
  int count = 7;
  double ratio = 0.1;
  bool closed = false;
  std::filesystem::path file;
  std::vector<Leaf> leaves;
  std::optional<Leaf> only;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  std::vector<std::string> warnings;
  JsonKeys other;
};
void ListKeys(JsonKeys& j, Tree& t) {
  j("count", t.count)("ratio", t.ratio)("closed", t.closed)("file", t.file)("leaves", t.leaves)
      .IfAny("only", t.only)("normal", t.normal);
  j.IfAny("warnings", t.warnings).Say("twice", 2 * t.count)("other", t.other);
}

TEST(JsonKeys, WhatWasWrittenIsReadBack) {
  Tree tree;
  tree.count = 3;
  tree.ratio = 1.0 / 3;
  tree.closed = true;
  tree.file = "a/b.ply";
  tree.leaves = {{"x \"y\"", 0.5}, {"z", {}}};
  tree.normal = {1, -2, 3e-300};
  tree.other = *JsonKeys::Parse(R"({"b": [1, {"c": null}], "a": 2})");
  const std::string text = JsonKeys(tree).Text();
  EXPECT_EQ(
      text,
      R"({"count":3,"ratio":0.3333333333333333,"closed":true,"file":"a/b.ply","leaves":[{"name":"x \"y\"","error_px":0.5},{"name":"z","error_px":null}],)"
      R"("normal":[1.0,-2.0,3e-300],"twice":6,"other":{"b":[1,{"c":null}],"a":2}})");
  Tree again;
  EXPECT_TRUE(JsonKeys::Parse(text)->Into(again));
  EXPECT_EQ(JsonKeys(again).Text(), text);
  EXPECT_EQ(again.leaves[0].error_px, 0.5);
  EXPECT_FALSE(again.leaves[1].error_px.has_value());
}

TEST(JsonKeys, WhatIsMissingOrOfAnotherTypeStaysAsItWasAndIsTold) {
  for (const char* text :
       {"{}", R"({"count": "many"})", R"({"count": null, "leaves": 3})", R"({"leaves": [1, {"name": 2}]})"}) {
    Tree tree;
    EXPECT_FALSE(JsonKeys::Parse(text)->Into(tree)) << text;
    EXPECT_EQ(tree.count, 7) << text;
  }
  // Also where every key of what was wanted may be missing.
  Tree whole;
  auto torn = *JsonKeys::Parse(JsonKeys(Tree()).Text());
  EXPECT_TRUE(torn.Into(whole));
  torn.Say("only", 3);
  EXPECT_FALSE(torn.Into(whole));
  EXPECT_FALSE(JsonKeys::Parse("[1]").has_value());
  EXPECT_FALSE(JsonKeys::Parse("{ torn").has_value());
}

TEST(JsonKeys, NumbersThatAreNotFiniteAreNull) {
  Leaf leaf{"", std::numeric_limits<double>::quiet_NaN()};
  EXPECT_EQ(JsonKeys(leaf).Text(), R"({"name":"","error_px":null})");
}

}  // namespace
}  // namespace lumi
