#include "scene/files/provenance.h"

#include <OpenImageIO/hash.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <fstream>
#include <string_view>

#include "scene/files/atomic_file.h"
#include "scene/files/json_keys.h"
#include "scene/files/open_to_read.h"
#include "scene/program/error.h"
#include "scene/program/printable.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr std::uintmax_t kWholeBytes = 1 << 20;   // files up to here are hashed whole
constexpr std::uintmax_t kWholeOfMany = 1 << 16;  // of many files
constexpr std::size_t kSampleBytes = 1 << 15;     // of larger ones: so much of head and tail

std::uintmax_t WholeBytesAmong(std::size_t files) { return files > kManyFiles ? kWholeOfMany : kWholeBytes; }

InputError Unreadable(const fs::path& path) { return InputError(path, "cannot be read"); }

std::string FileFingerprint(const fs::path& path, std::uintmax_t whole_bytes = kWholeBytes) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) throw Unreadable(path);
  if (size <= whole_bytes) return fmt::format("{}-{}", size, HashOf(ReadText(path)));
  std::ifstream in = OpenToRead(path);
  std::string ends(2 * kSampleBytes, '\0');
  in.read(ends.data(), kSampleBytes);
  in.seekg(-static_cast<std::streamoff>(kSampleBytes), std::ios::end);
  in.read(ends.data() + kSampleBytes, kSampleBytes);
  if (!in) throw Unreadable(path);
  const auto time =
      std::chrono::duration_cast<std::chrono::nanoseconds>(fs::last_write_time(path).time_since_epoch()).count();
  return fmt::format("{}-{}-{}", size, time, HashOf(ends));
}

fs::path ProvenancePath(const fs::path& scene_folder, const std::string& stage) {
  if (stage.empty() || stage.find_first_of("/\\") != std::string::npos || stage.front() == '.')
    throw std::invalid_argument("provenance: \"" + stage + "\" is no name of a stage");
  return scene_folder / "provenance" / (stage + ".json");
}

// JSON is UTF-8, names of files are any bytes: what is no UTF-8 is written as this word and its bytes in \xHH.
constexpr std::string_view kBytes = "bytes:";
std::string Written(const std::string& text) {
  if (IsUtf8(text) && !text.starts_with(kBytes)) return text;
  std::string written(kBytes);
  for (const char c : text)
    written +=
        c > 0x20 && c < 0x7F && c != '\\' ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  return written;
}
std::string AsGiven(const std::string& written) {
  if (!written.starts_with(kBytes)) return written;
  std::string text;
  for (std::size_t i = kBytes.size(); i < written.size(); ++i) {
    unsigned char byte = 0;
    const char* const end = written.data() + std::min(written.size(), i + 4);
    if (written.compare(i, 2, "\\x") != 0 ||
        std::from_chars(written.data() + i + 2, end, byte, 16).ptr != written.data() + i + 4) {
      text += written[i];
      continue;
    }
    text += static_cast<char>(byte);
    i += 3;
  }
  return text;
}
template <typename Convert>
void ConvertAll(Provenance& p, Convert convert) {
  for (auto* part : {&p.options, &p.inputs, &p.outputs}) {
    std::map<std::string, std::string> converted;
    for (const auto& [key, value] : *part) converted[convert(key)] = convert(value);
    *part = std::move(converted);
  }
}

// The first key whose value differs, in words; empty where the maps are equal.
std::string FirstDifference(const char* what, const std::map<std::string, std::string>& before,
                            const std::map<std::string, std::string>& now) {
  for (const auto& [key, value] : now) {
    const auto it = before.find(key);
    if (it == before.end()) return fmt::format("{} {} is new", what, key);
    if (it->second != value) return fmt::format("{} {} changed from {} to {}", what, key, it->second, value);
  }
  for (const auto& [key, value] : before)
    if (!now.contains(key)) return fmt::format("{} {} is gone", what, key);
  return {};
}

}  // namespace

void ListKeys(JsonKeys& j, Provenance& p) {
  j("stage", p.stage, "version", p.version, "options", p.options, "inputs", p.inputs, "outputs", p.outputs, "seconds",
    p.seconds);
}

std::string HashOf(const std::string& bytes) {
  return fmt::format("{:016x}", OIIO::xxhash::XXH64(bytes.data(), bytes.size(), 0));
}

std::string FingerprintAmong(const fs::path& file, std::size_t files) {
  return FileFingerprint(file, WholeBytesAmong(files));
}

std::string Fingerprint(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return "absent";
  if (status.type() != fs::file_type::directory) return FileFingerprint(path);
  std::vector<std::string> names;
  constexpr auto kFollowAndSkip =
      fs::directory_options::follow_directory_symlink | fs::directory_options::skip_permission_denied;
  for (fs::recursive_directory_iterator it(path, kFollowAndSkip, error), end; !error && it != end;
       it.increment(error)) {
    const std::string name = it->path().filename().string();
    // Locks and temporaries come and go while nothing changes.
    if (name.starts_with('.') || name == "LOCK") {
      it.disable_recursion_pending();
      continue;
    }
    std::error_code ignored;
    if (it->is_regular_file(ignored)) names.push_back(it->path().lexically_relative(path).string());
  }
  if (error) throw InputError(path, "cannot be listed: " + error.message());
  std::sort(names.begin(), names.end());
  std::string all;
  for (const std::string& name : names) all += name + '\0' + FingerprintAmong(path / name, names.size()) + '\n';
  return fmt::format("{}-files-{}", names.size(), HashOf(all));
}

void WriteProvenance(const fs::path& scene_folder, const Provenance& p) {
  std::vector<fs::path> written;
  for (const auto& [name, fingerprint] : p.outputs) written.push_back(scene_folder / name);
  if (!written.empty()) FlushToDisk(scene_folder, written);
  const fs::path record = ProvenancePath(scene_folder, p.stage);
  Provenance written_as = p;
  ConvertAll(written_as, Written);
  WriteTextAtomically(record, JsonKeys(written_as).Text(2) + "\n");
  FlushToDisk(scene_folder, {record});
}

std::optional<Provenance> ReadProvenance(const fs::path& scene_folder, const std::string& stage) {
  const fs::path path = ProvenancePath(scene_folder, stage);
  std::error_code error;
  if (!fs::exists(path, error)) return std::nullopt;
  const auto json = JsonKeys::Parse(ReadText(path));
  Provenance p;
  if (!json || !json->Into(p)) return std::nullopt;
  ConvertAll(p, AsGiven);
  return p;
}

bool IsAsRecorded(const fs::path& output) {
  const fs::path scene_folder = output.parent_path();
  std::error_code error;
  for (fs::directory_iterator it(scene_folder / "provenance", error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() != ".json") continue;
    const auto record = ReadProvenance(scene_folder, it->path().stem().string());
    if (!record) continue;
    const auto written = record->outputs.find(output.filename().string());
    if (written != record->outputs.end() && written->second == Fingerprint(output)) return true;
  }
  return false;
}

void RecordMeasured(const fs::path& scene, const std::string& what, const std::vector<fs::path>& written) {
  const fs::path scene_folder = scene.empty() ? fs::path(".") : scene;
  std::error_code error;
  if (!fs::exists(scene_folder / "lumigraph.json", error)) return;
  Provenance record{.stage = kMeasured + what, .version = kVersion};
  for (const fs::path& file : written)
    record.outputs[file.lexically_normal().lexically_relative(scene.lexically_normal()).string()] = Fingerprint(file);
  WriteProvenance(scene_folder, record);
}

bool IsUpToDate(const fs::path& scene_folder, const Provenance& wanted, std::string* why) {
  const auto no = [&](const std::string& reason) {
    if (why) *why = Printable(reason);
    return false;
  };
  std::error_code error;
  if (!fs::exists(ProvenancePath(scene_folder, wanted.stage), error)) return no("it has not been run here");
  const auto record = ReadProvenance(scene_folder, wanted.stage);
  if (!record) return no("its record cannot be read");  // then it runs again: nothing is lost but time
  const Provenance& before = *record;
  if (before.version != wanted.version)
    return no(fmt::format("version {} wrote it, this is {}", before.version, wanted.version));
  if (const std::string difference = FirstDifference("option", before.options, wanted.options); !difference.empty())
    return no(difference);
  if (const std::string difference = FirstDifference("input", before.inputs, wanted.inputs); !difference.empty())
    return no(difference);
  for (const auto& [name, fingerprint] : before.outputs)
    if (fingerprint == kChangedLater ? !fs::exists(scene_folder / name, error)
                                     : Fingerprint(scene_folder / name) != fingerprint)
      return no(fmt::format("output {} is not as it was written", name));
  if (why) why->clear();
  return true;
}

}  // namespace lumi
