#include "tests/support/bad_input.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "tests/support/same_outputs.h"

namespace lumi {
namespace fs = std::filesystem;
using testing::HasSubstr;

std::string Contents(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return "absent";
  std::vector<fs::path> files;
  if (fs::is_directory(path)) {
    for (const auto& entry : fs::recursive_directory_iterator(path)) files.push_back(entry.path());
  } else {
    files.push_back(path);
  }
  std::sort(files.begin(), files.end());
  std::string text;
  for (const fs::path& file : files) {
    text += file.lexically_relative(path).string();
    if (fs::is_regular_file(file)) {
      const std::string bytes = WholeFile(file);
      text.append(" ")
          .append(std::to_string(bytes.size()))
          .append(" ")
          .append(std::to_string(std::hash<std::string>{}(bytes)));
    }
    text += "\n";
  }
  return text;
}

void ExpectRefusal(const Refusal& refusal) {
  std::string command;
  for (const std::string& a : refusal.argv) command += a + " ";
  SCOPED_TRACE(command);
  std::vector<std::string> before;
  for (const fs::path& path : refusal.users) before.push_back(Contents(path));
  const std::string output_before = refusal.output.empty() ? "" : Contents(refusal.output);

  const ProgramResult for_people = RunProgram(refusal.argv, refusal.environment);
  std::vector<std::string> with_json = refusal.argv;
  with_json.push_back("--json");
  const ProgramResult json = RunProgram(with_json, refusal.environment);

  for (const ProgramResult* result : {&for_people, &json}) {
    EXPECT_EQ(result->exit_code, refusal.exit_code) << result->err;
    // Remarks may come before; the refusal is the last line, begins with the program's name, and is the only such.
    const std::vector<std::string> lines = result->ErrorLines();
    ASSERT_FALSE(lines.empty());
    const std::string name = fs::path(refusal.argv[0]).filename().string() + ": ";
    EXPECT_THAT(lines.back(), testing::StartsWith(name));
    EXPECT_EQ(
        std::count_if(lines.begin(), lines.end(), [&](const std::string& line) { return line.starts_with(name); }), 1)
        << result->err;
    for (const std::string& part : refusal.line_names) EXPECT_THAT(lines.back(), HasSubstr(part));
  }
  EXPECT_EQ(for_people.out, "");
  const auto parsed = nlohmann::json::parse(json.out, nullptr, false);
  ASSERT_TRUE(parsed.is_object() && parsed.contains("error")) << json.out;
  EXPECT_EQ(parsed["error"]["code"], refusal.exit_code);
  EXPECT_FALSE(parsed["error"]["message"].get<std::string>().empty());

  for (std::size_t i = 0; i < refusal.users.size(); ++i)
    EXPECT_EQ(Contents(refusal.users[i]), before[i]) << refusal.users[i];
  if (!refusal.output.empty()) {
    EXPECT_EQ(Contents(refusal.output), output_before) << "left behind in " << refusal.output;
  }
}

}  // namespace lumi
