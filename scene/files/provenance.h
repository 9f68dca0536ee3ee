// SCENE/provenance/STAGE.json: what a stage read, with which options, and what it wrote; so that a second run redoes
// only what changed, and a run killed anywhere goes on.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scene/files/json_keys.h"

namespace lumi {

// Names and values may be of any bytes: what is no UTF-8 is written as "bytes:" and its bytes.
struct Provenance {
  std::string stage;                           // "reconstruct", "proxy-auto", ...
  std::string version;                         // of this suite
  std::map<std::string, std::string> options;  // as given and defaulted, without threads, json and quiet
  std::map<std::string, std::string> inputs;   // path -> fingerprint
  std::map<std::string, std::string> outputs;  // path (relative to the scene) -> fingerprint
  double seconds = 0;
};

void ListKeys(JsonKeys& j, Provenance& p);

// Content hash (XXH64 of the bytes, size in front) for files up to 1 MB; size, time and the hash of head and tail for
// larger ones. A folder: of the sorted names and fingerprints of its files; of more than kManyFiles those above 128 kB
// count as larger ones, so that gigabytes of photos are not read at each start. "absent" where there is nothing.
constexpr std::size_t kManyFiles = 1000;
std::string Fingerprint(const std::filesystem::path& path);
// The fingerprint of a file that is one of `files` files in its folder.
std::string FingerprintAmong(const std::filesystem::path& file, std::size_t files);

// XXH64, sixteen hexadecimal digits.
std::string HashOf(const std::string& bytes);

// In place of an output's fingerprint: a file that later stages change. It has to be there.
inline constexpr const char* kChangedLater = "changed by later stages";

// What STAGE recorded in that folder; none where it has not, or where that cannot be read.
std::optional<Provenance> ReadProvenance(const std::filesystem::path& scene_folder, const std::string& stage);
// Whether a file or folder that lies in a scene is as the record of the stage that wrote it has it.
bool IsAsRecorded(const std::filesystem::path& output);
// Comes last: the outputs are on the disk, also after losing power, before the record says that they are there
// (FlushToDisk).
void WriteProvenance(const std::filesystem::path& scene_folder, const Provenance& provenance);

// A record of files that a measuring run left in a scene, right after they are written; no stage is decided by it.
// Nothing where the folder is no scene of ours.
inline constexpr const char* kMeasured = "measured-";  // before WHAT, as such a record's stage
void RecordMeasured(const std::filesystem::path& scene_folder, const std::string& what,
                    const std::vector<std::filesystem::path>& written);

// Whether stage `wanted` has nothing to do: version, options and inputs equal, recorded outputs still as written.
// *why names the first difference.
bool IsUpToDate(const std::filesystem::path& scene_folder, const Provenance& wanted, std::string* why = nullptr);

}  // namespace lumi
