#include "pipeline/batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <mutex>
#include <set>
#include <sstream>
#include <thread>
#include <utility>

#include "pipeline/named_remarks.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Followed at once; others wait until one has ended.
constexpr std::size_t kMostAtOnce = 64;
// Beside the scenes.
constexpr const char* kJobs = "jobs";
constexpr const char* kTable = "batch.json";

void RunOne(const BatchOptions& options, ProgressSink& progress, BatchCapture& capture) {
  std::vector<std::string> arguments{capture.input.string(), "-o", capture.scene.string()};
  arguments.insert(arguments.end(), options.arguments.begin(), options.arguments.end());
  const Sibling sibling{"lumi-pipeline", std::move(arguments), capture.name + " ", capture.name + ": "};
  const Stopwatch watch;
  try {
    capture.seconds =
        (options.executor ? options.executor->Run({capture.name, sibling}, progress) : RunSibling(sibling, progress))
            .seconds;
  } catch (const Interrupted&) {
    throw;
  } catch (const Error& e) {
    capture.seconds = watch.Seconds();
    capture.failed = e.file().empty() ? e.what() : e.file().string() + ": " + e.what();
    capture.code = static_cast<int>(e.code());
  } catch (const std::exception& e) {
    capture.seconds = watch.Seconds();
    capture.failed = e.what();
    capture.code = static_cast<int>(ExitCode::kBug);
  }
}

// The exit code of the captures that failed; where theirs differ, that of data that do not allow it.
ExitCode CommonCode(const std::vector<BatchCapture>& captures) {
  std::set<int> codes;
  for (const BatchCapture& c : captures)
    if (!c.failed.empty()) codes.insert(c.code);
  return codes.size() == 1 ? static_cast<ExitCode>(*codes.begin()) : ExitCode::kDataRefused;
}

}  // namespace

std::vector<std::string> CaptureArguments(const std::vector<std::string>& line) {
  const std::set<std::string> with_value{"--batch", "-o", "--output", "--executor", "--partition", "--sbatch-option"};
  std::vector<std::string> rest;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const std::string name = line[i].substr(0, line[i].find('='));
    if (name == "--json" || (line[i].starts_with("-o") && line[i].size() > 2)) continue;
    if (!with_value.contains(name))
      rest.push_back(line[i]);
    else if (name == line[i])
      ++i;
  }
  return rest;
}

std::vector<BatchCapture> ReadBatch(const fs::path& list, const fs::path& output) {
  constexpr std::size_t kLargest = 16 << 20;
  std::istringstream lines(ReadText(list, kLargest));
  std::vector<BatchCapture> captures;
  std::map<std::string, int> line_of;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ' || line.back() == '\t')) line.pop_back();
    line.erase(0, std::min(line.find_first_not_of(" \t"), line.size()));
    if (line.empty() || line.front() == '#') continue;
    fs::path input = fs::path(line).is_absolute() ? fs::path(line) : fs::absolute(list).parent_path() / line;
    input = input.lexically_normal();
    if (input.filename().empty()) input = input.parent_path();
    std::error_code error;
    if (!fs::exists(input, error)) throw InputError(list, fmt::format("line {}: {} is not there", number, line));
    // A folder's name may have a dot in it.
    const std::string name = (fs::is_directory(input, error) ? input.filename() : input.stem()).string();
    if (name.empty() || name == "." || name == ".." || name == kJobs || name == kTable)
      throw InputError(list, fmt::format("line {}: {} has no name that a scene could have", number, line));
    if (const auto [other, fresh] = line_of.emplace(name, number); !fresh)
      throw InputError(
          list, fmt::format("lines {} and {}: both would become {}", other->second, number, (output / name).string()),
          "give one of the inputs another name");
    captures.push_back({name, input, output / name});
  }
  if (captures.empty()) throw InputError(list, "names no input", "an input a line");
  return captures;
}

BatchSummary RunBatch(const BatchOptions& options, ProgressSink& progress) {
  if (options.output.empty()) throw UsageError("-o OUT is missing", "name the folder that the scenes go to");
  BatchSummary summary;
  summary.captures = ReadBatch(options.list, options.output);
  const Stopwatch watch;
  if (!options.executor) {
    for (BatchCapture& c : summary.captures) {
      RunOne(options, progress, c);
      if (!c.failed.empty()) progress.Message(fmt::format("{}: failed: {}", c.name, c.failed));
    }
  } else {
    Progress all(progress, "captures", static_cast<long>(summary.captures.size()));
    std::mutex mutex;
    std::atomic<std::size_t> next = 0;
    std::exception_ptr stopped;
    std::vector<std::jthread> followers;
    for (std::size_t t = 0; t < std::min(kMostAtOnce, summary.captures.size()); ++t)
      followers.emplace_back([&] {
        try {
          for (std::size_t i; (i = next++) < summary.captures.size();) {
            BatchCapture& c = summary.captures[i];
            NamedRemarks remarks(progress, mutex, c.name);
            RunOne(options, remarks, c);
            if (!c.failed.empty()) remarks.Message("failed: " + c.failed);
            all.Step();
          }
        } catch (...) {
          const std::lock_guard lock(mutex);
          if (!stopped) stopped = std::current_exception();
        }
      });
    for (std::jthread& f : followers) f.join();
    if (stopped) std::rethrow_exception(stopped);
  }
  summary.seconds = watch.Seconds();
  const auto failed = std::ranges::count_if(summary.captures, [](const BatchCapture& c) { return !c.failed.empty(); });
  std::error_code error;
  fs::create_directories(options.output, error);
  WriteTextAtomically(options.output / kTable, JsonKeys(summary).Text(1) + "\n");
  if (failed > 0)
    throw Error(CommonCode(summary.captures),
                fmt::format("{} of {} captures failed: see {}", failed, summary.captures.size(),
                            (options.output / kTable).string()),
                {}, "the same command goes on with them");
  return summary;
}

void ListKeys(JsonKeys& j, BatchCapture& c) {
  j("name", c.name, "input", c.input, "scene", c.scene, "seconds", c.seconds).IfAny("failed", c.failed);
  if (c.code != 0) j("code", c.code);
}
void ListKeys(JsonKeys& j, BatchSummary& s) { j("captures", s.captures, "seconds", s.seconds); }

std::string Describe(const BatchSummary& s) {
  std::string text;
  for (const BatchCapture& c : s.captures)
    text += fmt::format("{:<24} {:8.1f} s  {}\n", c.name, c.seconds, c.scene.string());
  return text + fmt::format("{} captures in {:.1f} s", s.captures.size(), s.seconds);
}

}  // namespace lumi
