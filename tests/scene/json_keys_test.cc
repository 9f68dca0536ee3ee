#include "scene/files/json_keys.h"

#include <gtest/gtest.h>

#include <limits>

#include "scene/files/json_limits.h"

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
  EXPECT_EQ(text, R"({"count":3,"ratio":0.3333333333333333,"closed":true,"file":"a/b.ply",)"
                  R"("leaves":[{"name":"x \"y\"","error_px":0.5},{"name":"z","error_px":null}],)"
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

struct Sizes {
  std::size_t size = 1;
  std::vector<int> row = {2};
};
void ListKeys(JsonKeys& j, Sizes& s) { j("size", s.size, "row", s.row); }

TEST(JsonKeys, ANumberThatItsMemberCannotHoldIsOfAnotherType) {
  for (const char* text : {R"({"count": 4294967297})", R"({"count": -4294967297})", R"({"count": 1e300})"}) {
    Tree tree;
    EXPECT_FALSE(JsonKeys::Parse(text)->Into(tree)) << text;
    EXPECT_EQ(tree.count, 7) << text;
  }
  Sizes sizes;
  EXPECT_FALSE(JsonKeys::Parse(R"({"size": -1, "row": [1, 4294967297]})")->Into(sizes));
  EXPECT_EQ(sizes.size, 1U);
  EXPECT_EQ(sizes.row, std::vector<int>{2});
  EXPECT_TRUE(JsonKeys::Parse(R"({"size": 18446744073709551615, "row": [2147483647, -2147483648]})")->Into(sizes));
  EXPECT_EQ(sizes.size, std::numeric_limits<std::size_t>::max());
  EXPECT_EQ(sizes.row, (std::vector<int>{std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}));
}

std::string Repeated(const std::string& text, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += text;
  return all;
}

// A megabyte of brackets would overflow the stack where the tree is copied or printed.
TEST(JsonLimits, WhatIsNestedTooDeeplyIsRefusedBeforeItIsParsed) {
  const auto nested = [](std::size_t levels) { return Repeated("[", levels) + Repeated("]", levels); };
  EXPECT_EQ(JsonBeyondLimits(nested(kDeepestJson)), nullptr);
  EXPECT_NE(JsonBeyondLimits(nested(kDeepestJson + 1)), nullptr);
  EXPECT_FALSE(JsonKeys::Parse("{\"inner\": " + nested(1000000) + "}").has_value());
  // Side by side, in texts and in comments they are not nested.
  EXPECT_EQ(JsonBeyondLimits("[" + Repeated("[],{},", 1000) + "1]"), nullptr);
  EXPECT_EQ(JsonBeyondLimits("[\"" + Repeated("[\\\"{", 1000) + "\"]"), nullptr);
  EXPECT_EQ(JsonBeyondLimits("// it's \" " + Repeated("[", 1000) + "\n/* \" " + Repeated("{", 1000) + "*/ {}"),
            nullptr);
  EXPECT_NE(JsonBeyondLimits("// it's \" \n" + nested(1000)), nullptr);
}

TEST(JsonLimits, AnObjectOfTooManyKeysIsRefused) {
  EXPECT_EQ(JsonBeyondLimits("[" + Repeated("{\"a:b\": {\"c\": 1}},", kMostJsonKeys) + "1]"), nullptr);
  EXPECT_EQ(JsonBeyondLimits("{" + Repeated("\"a\":1,", kMostJsonKeys)), nullptr);
  EXPECT_NE(JsonBeyondLimits("{" + Repeated("\"a\":1,", kMostJsonKeys + 1)), nullptr);
}

TEST(JsonKeys, NumbersThatAreNotFiniteAreNull) {
  Leaf leaf{"", std::numeric_limits<double>::quiet_NaN()};
  EXPECT_EQ(JsonKeys(leaf).Text(), R"({"name":"","error_px":null})");
}

}  // namespace
}  // namespace lumi
