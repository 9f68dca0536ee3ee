// Depth maps of all photos while stereo works: on disk as they are finished, so that a killed run goes on, and the last
// ones used in memory, up to a bound.
#pragma once

#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proxy/dense/depth_map.h"
#include "scene/files/filled_in_parts.h"
#include "scene/program/part.h"

namespace lumi {

// Whose maps a store has: of each photo one after each of so many rounds.
struct StoredMaps {
  std::vector<std::string> photos = {};
  int rounds = 1;
};

class DepthStore {
 public:
  // What is in a store's folder: the key, and maps.
  static constexpr const char* kMadeFrom = "made-from.txt";
  static std::string FileName(const std::string& photo, int round);

  // `folder` belongs to the store. Maps that an earlier run left there are taken where it was made from the same `key`,
  // a text of a line for each thing; else they are removed. `bytes`: of maps in memory; two are kept in any case.
  // part: the store is of one of several processes that fill the folder together. Throws PartsDiffer where maps of
  // another key were made in parts and are not complete.
  DepthStore(std::filesystem::path folder, const std::string& key, std::size_t bytes, StoredMaps maps = {},
             std::optional<Part> part = {});

  // Removes what losing power left incomplete of these photos' maps. To be called first.
  void RemoveDamaged(const std::vector<std::string>& photos);
  // For each of the store's photos the round that it is at, `rounds` where it has its last map: the first without a map
  // after a round that all photos have a map of. What is missing, whatever removed it, can be made from what is there.
  std::vector<int> NextRounds() const;
  bool Has(const std::string& photo, int round) const;

  // All maps are there: the folder is as one run leaves it.
  void ForgetParts() const;
  // All maps of these photos are on the disk, also after losing power.
  void Flush(const std::vector<std::string>& photos) const;
  std::shared_ptr<const DepthMap> Load(const std::string& photo, int round);
  void Store(const std::string& photo, int round, DepthMap map);
  void Remove(const std::string& photo, int round);

 private:
  using Key = std::pair<std::string, int>;
  struct Held {
    Key key;
    std::shared_ptr<const DepthMap> map;
  };
  std::filesystem::path FileOf(const std::string& photo, int round) const { return folder_ / FileName(photo, round); }
  void JoinParts(const std::string& key, const Part& part);
  bool IsComplete() const;
  void RemoveAllFiles();
  void Hold(const Key& key, std::shared_ptr<const DepthMap> map);

  std::filesystem::path folder_;
  FilledInParts files_;
  StoredMaps maps_;
  bool suspicious_ = false;  // the machine was restarted since maps were written
  std::size_t bytes_, held_bytes_ = 0;
  std::list<Held> held_;  // the last used first
};

}  // namespace lumi
