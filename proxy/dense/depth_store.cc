#include "proxy/dense/depth_store.h"

#include <fmt/format.h>

#include <algorithm>

#include "proxy/dense/depth_files.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;

DepthStore::DepthStore(fs::path folder, const std::string& key, std::size_t bytes)
    : folder_(std::move(folder)), bytes_(bytes) {
  const fs::path made_from = folder_ / kMadeFrom;
  std::error_code error;
  if (fs::exists(made_from, error) && ReadText(made_from) == key) {
    if (RestartedSince(folder_)) RemoveDamaged();
    NoteRunOfMachine(folder_);
    return;
  }
  fs::remove_all(folder_, error);
  NoteRunOfMachine(folder_);
  WriteTextAtomically(made_from, key);
}

void DepthStore::RemoveDamaged() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    if (entry.path().extension() == ".planes") files.push_back(entry.path());
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

bool DepthStore::Done(const std::string& photo, int round, int rounds) const {
  std::error_code error;
  for (; round < rounds; ++round)
    if (fs::exists(FileOf(photo, round), error)) return true;
  return false;
}

void DepthStore::ForgetUnlessWhole(const std::vector<std::string>& photos, int rounds) {
  std::error_code error;
  const auto last = [&](const std::string& photo) {
    int round = rounds - 1;
    while (round >= 0 && !fs::exists(FileOf(photo, round), error)) --round;
    return round;
  };
  int least = rounds;
  for (const std::string& photo : photos) least = std::min(least, last(photo));
  const bool whole = std::ranges::all_of(photos, [&](const std::string& photo) {
    const int round = last(photo);
    return round == least || (round == least + 1 && (least < 0 || fs::exists(FileOf(photo, least), error)));
  });
  if (whole) return;
  for (const std::string& photo : photos)
    for (int round = 0; round < rounds; ++round) Remove(photo, round);
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
