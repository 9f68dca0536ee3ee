#include "scene/program/main_program.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace lumi {
namespace {

struct Outcome {
  int code = 0;
  std::string out, err;
};

Outcome Start(std::vector<std::string> args, const std::function<std::string()>& body) {
  args.insert(args.begin(), "lumi-test");
  std::vector<char*> argv;
  for (auto& a : args) argv.push_back(a.data());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  Program program("lumi-test", "a test");
  Outcome o;
  o.code =
      program.Run(static_cast<int>(argv.size()), argv.data(), [&] { return Answer(*JsonKeys::Parse(body()), ""); });
  o.out = testing::internal::GetCapturedStdout();
  o.err = testing::internal::GetCapturedStderr();
  return o;
}

TEST(Program, ExitCodesAreTheContracts) {
  EXPECT_EQ(Start({}, [] { return "{}"; }).code, 0);
  EXPECT_EQ(Start({}, []() -> std::string { throw DataError("no"); }).code, 1);
  EXPECT_EQ(Start({"--no-such-option"}, [] { return "{}"; }).code, 2);
  EXPECT_EQ(Start({}, []() -> std::string { throw InputError("f.bin", "bad"); }).code, 3);
  EXPECT_EQ(Start({}, []() -> std::string { throw MachineError("full"); }).code, 4);
  EXPECT_EQ(Start({}, []() -> std::string { throw std::logic_error("oops"); }).code, 5);
  EXPECT_EQ(Start({}, []() -> std::string { throw Interrupted(); }).code, 130);
}

TEST(Program, AFailureIsOneLineThatNamesTheFileAndTheWayOut) {
  const Outcome o = Start(
      {"--quiet"}, []() -> std::string { throw InputError("scene/points3D.bin", "holds 12 bytes", "copy it again"); });
  EXPECT_EQ(o.err, "lumi-test: scene/points3D.bin: holds 12 bytes (copy it again)\n");
  EXPECT_EQ(o.out, "");
}

TEST(Program, JsonHasSchemaAndVersionAndAFailureItsError) {
  const auto ok = nlohmann::json::parse(Start({"--json"}, [] { return R"({"frames": 3})"; }).out);
  EXPECT_EQ(ok["schema"], "lumi-test");
  EXPECT_TRUE(ok.contains("version"));
  EXPECT_EQ(ok["frames"], 3);
  const auto bad = nlohmann::json::parse(
      Start({"--json"}, []() -> std::string { throw DataError("two photos do not overlap", "shoot more"); }).out);
  EXPECT_EQ(bad["error"]["code"], 1);
  EXPECT_EQ(bad["error"]["message"], "two photos do not overlap");
  EXPECT_EQ(bad["error"]["hint"], "shoot more");
}

TEST(Program, HelpAndVersionAreNoErrors) {
  const Outcome o = Start({"--help"}, [] { return "{}"; });
  EXPECT_EQ(o.code, 0);
  EXPECT_NE(o.out.find("--threads"), std::string::npos);
  EXPECT_EQ(Start({"--version"}, [] { return "{}"; }).code, 0);
}

}  // namespace
}  // namespace lumi
