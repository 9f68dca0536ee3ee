#include "reconstruct/colmap_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <cstring>
#include <regex>

#include "reconstruct/colmap_log.h"
#include "scene/program/error.h"
#include "scene/program/subprocess.h"

namespace lumi {

std::set<std::string> ParseColmapOptionNames(const std::string& help) {
  // Bytes that are no text hold a "--x" now and then.
  const auto no_text = [](char c) {
    return std::iscntrl(static_cast<unsigned char>(c)) && !std::isspace(static_cast<unsigned char>(c));
  };
  if (std::ranges::any_of(help, no_text)) return {};
  std::set<std::string> names;
  for (std::size_t at = help.find("--"); at != std::string::npos; at = help.find("--", at + 2)) {
    if (at > 0 && !std::isspace(static_cast<unsigned char>(help[at - 1]))) continue;
    std::size_t end = at + 2;
    while (end < help.size() &&
           (std::isalnum(static_cast<unsigned char>(help[end])) || help[end] == '_' || help[end] == '.'))
      ++end;
    if (end > at + 2) names.insert(help.substr(at + 2, end - at - 2));
  }
  return names;
}

std::optional<std::string> InstalledOptionName(const std::string& name, const std::set<std::string>& installed) {
  if (installed.count(name)) return name;
  // What 3.9 to 4.0 renamed: the parts that hold for every kind of feature left the Sift groups, those of one solver
  // the adjustment's, and images of one moment became frames.
  static const std::vector<std::pair<std::string, std::string>> kRenamed = {
      {"SiftExtraction.", "FeatureExtraction."},       {"SiftMatching.", "FeatureMatching."},
      {"SiftMatching.", "TwoViewGeometry."},           {"ExhaustiveMatching.", "ExhaustivePairing."},
      {"SequentialMatching.", "SequentialPairing."},   {"random_seed", "default_random_seed"},
      {"BundleAdjustment.", "BundleAdjustmentCeres."}, {"Mapper.ba_global_images_", "Mapper.ba_global_frames_"}};
  for (const auto& [old_part, new_part] : kRenamed) {
    if (!name.starts_with(old_part)) continue;
    const std::string candidate = new_part + name.substr(old_part.size());
    if (installed.count(candidate)) return candidate;
  }
  return std::nullopt;
}

// Throws where COLMAP was ended from outside, which says nothing about the photos. Its own abort() does: COLMAP refuses
// photos that way. Crashes on a GPU and in the last adjustment are no errors here: the step is run again on the CPU,
// and a scene without the last adjustment is a scene.
static void RequireNotKilled(const std::string& command, const SubprocessResult& result, bool on_gpu) {
  const bool out_of_memory = std::ranges::any_of(
      result.tail, [](const std::string& line) { return line.find("bad_alloc") != std::string::npos; });
  if (out_of_memory)
    throw MachineError(fmt::format("COLMAP ran out of memory ('{}')", command),
                       "use smaller photos (--quality low) or fewer of them; a second run goes on from here");
  const int signal = result.exit_code - 128;
  if (signal <= 0 || signal == SIGABRT) return;
  const bool crash = signal == SIGSEGV || signal == SIGBUS || signal == SIGILL || signal == SIGFPE;
  if (crash && (on_gpu || command == "bundle_adjuster")) return;
  const char* name = ::strsignal(signal);
  throw MachineError(
      fmt::format("COLMAP was ended by signal {} ({}) in '{}'", signal, name ? name : "unknown", command),
      signal == SIGKILL ? "the machine may be short of memory; a second run goes on from here"
                        : "a second run goes on from here");
}

ColmapProgram::ColmapProgram(std::filesystem::path log_file, ProgressSink& sink)
    : log_file_(std::move(log_file)), sink_(sink) {
  if (!FindProgram("colmap"))
    throw MachineError("the program colmap is not in PATH", "install it: apt-get install colmap");
  SubprocessOptions options;
  std::string text;
  options.on_line = [&](const std::string& line) { text += line + "\n"; };
  RunSubprocess({"colmap", "help"}, options);
  std::smatch match;
  if (std::regex_search(text, match, std::regex("COLMAP ([0-9]+(\\.[0-9]+)*)"))) version_ = match[1];
  has_cuda_ = text.find("with CUDA") != std::string::npos;
}

const std::set<std::string>& ColmapProgram::OptionNames(const std::string& command) {
  const auto known = names_.find(command);
  if (known != names_.end()) return known->second;
  std::string text;
  SubprocessOptions options;
  options.on_line = [&](const std::string& line) { text += line + "\n"; };
  RunSubprocess({"colmap", command, "-h"}, options);
  auto names = ParseColmapOptionNames(text);
  if (names.empty())
    throw MachineError(
        fmt::format("COLMAP{} tells no options for '{}'", version_.empty() ? "" : " " + version_, command),
        "install COLMAP 3.8 or later");
  return names_[command] = std::move(names);
}

bool ColmapProgram::HasOption(const std::string& command, const std::string& name) {
  return InstalledOptionName(name, OptionNames(command)).has_value();
}

int ColmapProgram::Run(const std::string& command, const std::vector<ColmapOption>& options, const std::string& task,
                       long total) {
  const auto& installed = OptionNames(command);
  std::vector<std::string> argv{"colmap", command};
  for (const auto& option : options) {
    const auto name = InstalledOptionName(option.name, installed);
    if (!name) {
      if (!option.required) continue;
      throw MachineError(fmt::format("COLMAP {} has no option --{} in '{}'", version_, option.name, command),
                         "install COLMAP 3.8 or later");
    }
    argv.push_back("--" + *name);
    argv.push_back(option.value);
  }
  Progress progress(sink_, task, total);
  long last = 0;
  SubprocessOptions run;
  run.log_file = log_file_;
  run.on_line = [&](const std::string& line) {
    const auto p = ParseColmapProgress(line);
    if (!p) return;
    if (p->total > 0 && p->total != total) progress.SetTotal(total = p->total);
    // A mapper that starts another model counts from the beginning again; progress does not run backwards.
    last = std::max(last, p->done);
    if (total > 0) last = std::min(last, total);
    progress.Set(last);
  };
  const SubprocessResult result = RunSubprocess(argv, run);
  seconds_ += result.seconds;
  tail_ = result.tail;
  const bool on_gpu =
      std::ranges::any_of(options, [](const ColmapOption& o) { return o.name.ends_with("use_gpu") && o.value == "1"; });
  RequireNotKilled(command, result, on_gpu);
  // COLMAP goes on where its database cannot be written, and then finds nothing: a full disk would look like photos
  // that do not overlap.
  constexpr std::uintmax_t kLeastFreeBytes = 1 << 20;
  std::error_code error;
  const auto space = std::filesystem::space(log_file_.parent_path(), error);
  if (!error && space.available < kLeastFreeBytes)
    throw MachineError("the disk is full", "free some space or choose another output", log_file_.parent_path());
  return result.exit_code;
}

std::string ColmapProgram::LastComplaint() const {
  for (auto it = tail_.rbegin(); it != tail_.rend(); ++it) {
    std::string lower = *it;
    std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
    if (lower.find("error") != std::string::npos || lower.find("check failed") != std::string::npos) {
      const auto from = it->find_first_not_of(" \t");
      return from == std::string::npos ? *it : it->substr(from);
    }
  }
  return {};
}

}  // namespace lumi
