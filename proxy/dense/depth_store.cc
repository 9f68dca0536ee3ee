#include "proxy/dense/depth_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "proxy/dense/depth_files.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;

namespace {

// Not the temporary of one.
bool IsMap(const fs::path& file) { return file.extension() == ".planes" && !file.filename().string().starts_with("."); }

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

DepthStore::DepthStore(fs::path folder, const std::string& key, std::size_t bytes, StoredMaps maps,
                       std::optional<Part> part)
    : folder_(std::move(folder)),
      files_(folder_, kMadeFrom, "depth maps", IsMap, DifferenceOfKeys,
             "give all parts, and the run that joins them, the same scene, options and kind of machine, or remove the "
             "folder"),
      maps_(std::move(maps)),
      bytes_(bytes) {
  if (part) {
    JoinParts(key, *part);
  } else if (files_.Keeps(key)) {
    // Nobody here knows which machines made the parts, and which of these lost power.
    suspicious_ = RestartedSince(folder_) || files_.MadeInParts();
    NoteRunOfMachine(folder_);
  } else {
    std::error_code error;
    fs::remove_all(folder_, error);
    NoteRunOfMachine(folder_);
    files_.Stamp(key);
  }
}

void DepthStore::JoinParts(const std::string& key, const Part& part) {
  {
    // One after the other: the first one removes what one run made from another key.
    const FolderLock lock(folder_, FolderLock::kInTurn);
    const bool same = files_.Keeps(key) || files_.MadeInParts();
    if (same && !files_.MadeInParts() && IsComplete()) return;  // nothing is left to make
    if (!same) RemoveAllFiles();
    files_.Join(key);
  }
  // Each part may have run on a machine of its own.
  const fs::path own = folder_ / fmt::format("part-{}-of-{}", part.index, part.count);
  suspicious_ = RestartedSince(own) || RestartedSince(folder_);
  NoteRunOfMachine(own);
}

bool DepthStore::IsComplete() const {
  return std::ranges::all_of(maps_.photos, [&](const std::string& photo) { return Has(photo, maps_.rounds - 1); });
}

// But for the lock.
void DepthStore::RemoveAllFiles() {
  std::vector<fs::path> all;
  for (const auto& entry : fs::directory_iterator(folder_))
    if (entry.path().filename() != "LOCK") all.push_back(entry.path());
  for (const fs::path& path : all) fs::remove_all(path);
}

void DepthStore::ForgetParts() const {
  files_.ForgetParts();
  std::vector<fs::path> notes;
  std::error_code error;
  for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error))
    if (it->path().filename().string().starts_with("part-") && it->is_directory(error)) notes.push_back(it->path());
  // Folders of photos stay: they hold more than a note.
  for (const fs::path& note : notes)
    if (std::distance(fs::directory_iterator(note, error), fs::directory_iterator()) == 1) fs::remove_all(note, error);
}

void DepthStore::RemoveDamaged(const std::vector<std::string>& photos) {
  if (!suspicious_) return;
  for (const std::string& photo : photos) {
    for (int round = 0; round < maps_.rounds; ++round) {
      if (!Has(photo, round)) continue;
      try {
        ReadPlanes(FileOf(photo, round));
      } catch (const InputError&) {
        fs::remove(FileOf(photo, round));
      }
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

std::vector<int> DepthStore::NextRounds() const {
  std::vector<std::vector<bool>> has;
  int all_have = maps_.rounds - 1;  // the least last round; -1: a photo has no map
  for (const std::string& photo : maps_.photos) {
    std::vector<bool>& rounds = has.emplace_back();
    int last = -1;
    for (int round = 0; round < maps_.rounds; ++round) {
      rounds.push_back(Has(photo, round));
      if (rounds.back()) last = round;
    }
    all_have = std::min(all_have, last);
  }
  const auto at = [](const std::vector<bool>& rounds, int round) { return rounds[static_cast<std::size_t>(round)]; };
  if (all_have >= 0 && !std::ranges::all_of(has, [&](const auto& rounds) { return at(rounds, all_have); }))
    all_have = -1;
  std::vector<int> next;
  for (const std::vector<bool>& rounds : has) {
    int round = all_have + 1;
    while (round < maps_.rounds && at(rounds, round)) ++round;
    next.push_back(round);
  }
  return next;
}

void DepthStore::Flush(const std::vector<std::string>& photos) const {
  std::vector<fs::path> files;
  for (const std::string& photo : photos)
    for (int round = 0; round < maps_.rounds; ++round)
      if (Has(photo, round)) files.push_back(FileOf(photo, round));
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
