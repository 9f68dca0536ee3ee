// The COLMAP program that is installed here: its version, its GPU use, its option names.
//
//   ColmapProgram colmap(log_file, sink);
//   colmap.Run("feature_extractor", {{"database_path", db}, {"SiftExtraction.use_gpu", "0"}}, "finding features", n);
//
// Options carry COLMAP 3.8's names; they are translated to what the installed version calls them.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "scene/program/progress.h"

namespace lumi {

struct ReconstructOptions;

struct ColmapOption {
  std::string name;  // as COLMAP 3.8 has it
  std::string value;
  bool required = true;  // false: left out where the installed version has no such option
};

// The option names in the text that `colmap COMMAND -h` prints; none where it holds bytes that are no text.
std::set<std::string> ParseColmapOptionNames(const std::string& help);
// What an installed version calls 3.8's option `name`; nullopt where it has none.
std::optional<std::string> InstalledOptionName(const std::string& name, const std::set<std::string>& installed);

class ColmapProgram {
 public:
  // Throws MachineError where there is no COLMAP. All it prints goes to `log_file`.
  ColmapProgram(std::filesystem::path log_file, ProgressSink& sink);

  const std::string& version() const { return version_; }  // "3.8"
  bool has_cuda() const { return has_cuda_; }
  double seconds() const { return seconds_; }  // spent in COLMAP so far

  // Runs a command, showing its progress. `total` is used for lines that do not tell theirs. Returns the exit code;
  // it is not to be trusted: check the outputs.
  int Run(const std::string& command, const std::vector<ColmapOption>& options, const std::string& task, long total);
  bool HasOption(const std::string& command, const std::string& name);
  const std::vector<std::string>& tail() const { return tail_; }  // last lines of the last run
  // Its last line that says "error" or "check failed", or an empty string.
  std::string LastComplaint() const;
  const std::filesystem::path& log_file() const { return log_file_; }

 private:
  const std::set<std::string>& OptionNames(const std::string& command);

  std::filesystem::path log_file_;
  ProgressSink& sink_;
  std::string version_;
  bool has_cuda_ = false;
  double seconds_ = 0;
  std::vector<std::string> tail_;
  std::map<std::string, std::set<std::string>> names_;
};

// What every step of a reconstruction by COLMAP works with.
struct ColmapJob {
  const ReconstructOptions& options;
  const std::filesystem::path& work_folder;  // SCENE/colmap
  ColmapProgram& colmap;
  ProgressSink& sink;
};

}  // namespace lumi
