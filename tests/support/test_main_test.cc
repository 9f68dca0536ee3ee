// What a test executable tells ctest: this one is started again, on tests that are skipped or fail where they are asked
// to.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "scene/program/subprocess.h"

namespace lumi {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

bool Asked(const char* what) {
  const char* sample = std::getenv("LUMI_SAMPLE");
  return sample && std::string(sample) == what;
}

TEST(Sample, Passes) {}
TEST(Sample, IsSkipped) {
  if (Asked("skip")) GTEST_SKIP() << "no camera here";
}
TEST(Sample, Fails) {
  if (Asked("fail")) FAIL() << "on purpose";
}

SubprocessResult RunSamples(const std::string& sample, const std::string& filter) {
  SubprocessOptions options;
  options.separate_stdout = true;
  options.environment = {{"LUMI_SAMPLE", sample}};
  return RunSubprocess({LUMI_BIN_DIR "/test_main_test", "--gtest_brief=1", "--gtest_filter=" + filter}, options);
}

TEST(TestMain, EndsAsSkippedWhereEverythingThatRanWas) {
  const SubprocessResult all = RunSamples("skip", "Sample.IsSkipped");
  EXPECT_EQ(all.exit_code, 77);
  EXPECT_THAT(all.out, HasSubstr("skipped: Sample.IsSkipped: no camera here\n"));
}

TEST(TestMain, PassesWhereSomethingPassedAndNamesWhatWasSkipped) {
  const SubprocessResult some = RunSamples("skip", "Sample.*");
  EXPECT_EQ(some.exit_code, 0);
  EXPECT_THAT(some.out, HasSubstr("skipped: Sample.IsSkipped: no camera here\n"));
  EXPECT_THAT(some.out, Not(HasSubstr("skipped: Sample.Passes")));
  EXPECT_EQ(RunSamples("", "Sample.*").exit_code, 0);
  EXPECT_EQ(RunSamples("", "NoSuchTest.*").exit_code, 0);
}

TEST(TestMain, FailsWhereSomethingFailed) { EXPECT_EQ(RunSamples("fail", "Sample.*").exit_code, 1); }

}  // namespace
}  // namespace lumi
