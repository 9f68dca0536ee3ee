// The main function of every test executable. ctest knows executables, not tests: one of which everything that ran was
// skipped ends with the code that ctest calls "skipped", and the tests that were skipped are named with their reason.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace {

constexpr int kSkipped = 77;  // SKIP_RETURN_CODE in cmake/LumiTargets.cmake

class SkippedTests : public testing::EmptyTestEventListener {
 public:
  void OnTestEnd(const testing::TestInfo& test) override {
    if (!test.result()->Skipped()) return;
    std::string why;
    for (int i = 0; i < test.result()->total_part_count(); ++i) {
      const testing::TestPartResult& part = test.result()->GetTestPartResult(i);
      if (part.skipped()) why += std::string(why.empty() ? "" : "; ") + part.message();
    }
    while (!why.empty() && why.back() == '\n') why.pop_back();
    std::printf("skipped: %s.%s: %s\n", test.test_suite_name(), test.name(), why.c_str());
    std::fflush(stdout);
  }
};

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  testing::UnitTest& all = *testing::UnitTest::GetInstance();
  all.listeners().Append(new SkippedTests);  // owned by GoogleTest
  const int code = RUN_ALL_TESTS();
  return code == 0 && all.skipped_test_count() > 0 && all.skipped_test_count() == all.test_to_run_count() ? kSkipped
                                                                                                          : code;
}
