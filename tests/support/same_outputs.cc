#include "tests/support/same_outputs.h"

#include <algorithm>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <regex>

namespace lumi {
namespace fs = std::filesystem;

std::string WholeFile(const fs::path& file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  const std::streamoff size = in ? static_cast<std::streamoff>(in.tellg()) : 0;
  std::string bytes(static_cast<std::size_t>(std::max<std::streamoff>(size, 0)), '\0');
  in.seekg(0).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  return bytes;
}

namespace {

using nlohmann::json;

bool IsTime(const std::string& key) {
  return key.find("seconds") != std::string::npos || key.ends_with("_s") || key == "ms" || key.ends_with("_ms") ||
         key.find("ms_per_frame") != std::string::npos || key == "peak_memory_mb" || key == "percent" ||
         key.ends_with("_percent");
}
// Of files that hold times, hashes differ.
bool IsHashOfTimes(const std::string& key, const json& value) {
  if (!value.is_string()) return false;
  static const std::regex kSizeTimeAndHash("[0-9]+--?[0-9]+-[0-9a-f]+");
  return value.get<std::string>().find("-files-") != std::string::npos ||
         std::regex_match(value.get<std::string>(), kSizeTimeAndHash) ||
         (key.ends_with(".json") || key.ends_with(".summary") || key.ends_with(".html"));
}

json WithoutTimes(const json& value) {
  if (value.is_array()) {
    json kept = json::array();
    for (const json& element : value) kept.push_back(WithoutTimes(element));
    return kept;
  }
  if (value.is_string()) {  // JSON in a string: a stage's summary among the options of a report
    const json inner = json::parse(value.get<std::string>(), nullptr, false);
    return inner.is_object() ? WithoutTimes(inner) : value;
  }
  if (!value.is_object()) return value;
  json kept = json::object();
  for (const auto& [key, inner] : value.items())
    if (!IsTime(key) && key != "reused") kept[key] = IsHashOfTimes(key, inner) ? json("a hash") : WithoutTimes(inner);
  return kept;
}

// A report holds times in its sentences and plots: of it only that it is whole.
std::string ComparableReport(const fs::path& file) {
  const std::string page = WholeFile(file);
  const auto end = page.find_last_not_of(" \n");
  return page.starts_with("<!") && end != std::string::npos && page.substr(0, end + 1).ends_with("</html>") ? "whole"
                                                                                                            : "cut off";
}

std::string Comparable(const fs::path& file) {
  if (file.filename() == "report.html") return ComparableReport(file);
  std::string bytes = WholeFile(file);
  // Taking times out of JSON takes long, and thousands of runs leave the same files.
  static std::map<std::pair<std::size_t, std::size_t>, std::string> known;
  std::string& comparable = known[{bytes.size(), std::hash<std::string>{}(bytes)}];
  if (!comparable.empty()) return comparable;
  if (!bytes.empty() && bytes.front() == '{')
    if (const json parsed = json::parse(bytes, nullptr, false); parsed.is_object()) bytes = WithoutTimes(parsed).dump();
  comparable = std::to_string(bytes.size()) + "-" + std::to_string(std::hash<std::string>{}(bytes));
  return comparable;
}

}  // namespace

std::map<std::string, std::string> ComparableFiles(const fs::path& folder) {
  std::map<std::string, std::string> files;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.starts_with('.') || name == "colmap") it.disable_recursion_pending();
    if (name.starts_with('.') || name == "LOCK" || name == "pipeline-times.txt" || name == "frames.txt" ||
        !it->is_regular_file())
      continue;
    files[it->path().lexically_relative(folder).generic_string()] = Comparable(it->path());
  }
  return files;
}

std::map<std::string, std::string> WholeState(const fs::path& folder) {
  static const std::regex kProcess("[.]lumi-tmp-[0-9]+-");
  std::map<std::string, std::string> state;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    std::string name = entry.path().lexically_relative(folder).string();
    if (name.find(".lumi-tmp-") != std::string::npos) name = std::regex_replace(name, kProcess, ".lumi-tmp-");
    const bool has_contents = entry.is_regular_file() && entry.path().filename() != "LOCK";
    state[name] = has_contents ? Comparable(entry.path()) : "";
  }
  return state;
}

std::string FirstDifference(const std::map<std::string, std::string>& wanted,
                            const std::map<std::string, std::string>& found) {
  for (const auto& [name, hash] : wanted) {
    const auto it = found.find(name);
    if (it == found.end()) return name + " is not there";
    if (it->second != hash) return name + " differs";
  }
  for (const auto& [name, hash] : found)
    if (!wanted.contains(name)) return name + " is there, too";
  return {};
}

std::string TemporariesIn(const fs::path& folder) {
  std::string names;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (const std::string name = it->path().filename().string(); name.find(".lumi-tmp-") != std::string::npos)
      names += it->path().string() + "\n";
  return names;
}

}  // namespace lumi
