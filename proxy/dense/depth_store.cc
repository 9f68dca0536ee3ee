#include "proxy/dense/depth_store.h"

#include <fmt/format.h>

#include <algorithm>

#include "proxy/dense/depth_files.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;

namespace {

bool IsMap(const fs::path& file) { return file.extension() == ".planes"; }

// How two keys differ first.
std::string DifferenceOfKeys(const std::string& there, const std::string& here) {
  const auto [one, other] = FirstDifference(there, here, "\n");
  const auto begins = [&](std::string_view word) { return one.starts_with(word) && other.starts_with(word); };
  // What follows is a hash, or a camera's numbers.
  for (const char* word : {"photos", "masks", "silhouettes"})
    if (begins(word)) return fmt::format("other {}", word);
  if (begins("camera ")) return "other cameras";
  return ThereAndHere(one, other);
}

}  // namespace

DepthStore::DepthStore(fs::path folder, const std::string& key, std::size_t bytes, std::optional<Part> part)
    : folder_(std::move(folder)),
      files_(folder_, kMadeFrom, "depth maps", IsMap, DifferenceOfKeys,
             "give all parts, and the run that joins them, the same scene, options and kind of machine, or remove the "
             "folder"),
      bytes_(bytes) {
  if (part) {
    files_.Join(key);
    // Each part may have run on a machine of its own.
    const fs::path own = folder_ / fmt::format("part-{}-of-{}", part->index, part->count);
    if (RestartedSince(own) || RestartedSince(folder_)) RemoveDamaged();
    NoteRunOfMachine(own);
  } else if (files_.Keeps(key)) {
    // Nobody here knows which machines made the parts, and which of these lost power.
    if (RestartedSince(folder_) || files_.MadeInParts()) RemoveDamaged();
    NoteRunOfMachine(folder_);
  } else {
    std::error_code error;
    fs::remove_all(folder_, error);
    NoteRunOfMachine(folder_);
    files_.Stamp(key);
  }
}

void DepthStore::RemoveDamaged() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    if (IsMap(entry.path())) files.push_back(entry.path());
  for (const fs::path& file : files) {
    try {
      ReadPlanes(file);
    } catch (const InputError&) {
      fs::remove(file);
    }
  }
}

std::string DepthStore::FileName(const std::string& photo, int round) {
  return fmt::format("{}.{}.planes", photo, round);
}

bool DepthStore::Has(const std::string& photo, int round) const {
  std::error_code error;
  return fs::exists(FileOf(photo, round), error);
}

int DepthStore::LastRound(const std::string& photo, int rounds) const {
  int round = rounds - 1;
  while (round >= 0 && !Has(photo, round)) --round;
  return round;
}

bool DepthStore::IsWhole(const std::vector<std::string>& photos, int rounds) const {
  std::vector<int> last;
  for (const std::string& photo : photos) last.push_back(LastRound(photo, rounds));
  if (photos.empty()) return true;
  const int least = std::max(0, *std::ranges::min_element(last));
  for (std::size_t i = 0; i < photos.size(); ++i)
    for (int round = least; round < last[i]; ++round)
      if (!Has(photos[i], round)) return false;
  return true;
}

void DepthStore::RemoveAll(const std::vector<std::string>& photos, int rounds) {
  for (const std::string& photo : photos)
    for (int round = 0; round < rounds; ++round) Remove(photo, round);
}

void DepthStore::Flush(const std::vector<std::string>& photos, int rounds) const {
  std::vector<fs::path> files;
  for (const std::string& photo : photos)
    if (const int last = LastRound(photo, rounds); last >= 0) files.push_back(FileOf(photo, last));
  FlushToDisk(folder_, files);
}

std::shared_ptr<const DepthMap> DepthStore::Load(const std::string& photo, int round) {
  const Key key{photo, round};
  const auto at = std::ranges::find_if(held_, [&](const Held& h) { return h.key == key; });
  if (at != held_.end()) {
    held_.splice(held_.begin(), held_, at);
    return at->map;
  }
  auto map = std::make_shared<const DepthMap>(ReadPlanes(FileOf(photo, round)));
  Hold(key, map);
  return map;
}

void DepthStore::Store(const std::string& photo, int round, DepthMap map) {
  WritePlanes(FileOf(photo, round), map);
  Hold({photo, round}, std::make_shared<const DepthMap>(std::move(map)));
}

void DepthStore::Remove(const std::string& photo, int round) {
  const Key key{photo, round};
  std::erase_if(held_, [&](const Held& h) {
    if (h.key != key) return false;
    held_bytes_ -= h.map->Bytes();
    return true;
  });
  std::error_code error;
  fs::remove(FileOf(photo, round), error);
}

void DepthStore::Hold(const Key& key, std::shared_ptr<const DepthMap> map) {
  held_bytes_ += map->Bytes();
  held_.push_front({key, std::move(map)});
  while (held_bytes_ > bytes_ && held_.size() > 2) {
    held_bytes_ -= held_.back().map->Bytes();
    held_.pop_back();
  }
}

}  // namespace lumi
