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

class DepthStore {
 public:
  // What is in a store's folder: the key, and maps.
  static constexpr const char* kMadeFrom = "made-from.txt";
  static std::string FileName(const std::string& photo, int round);

  // `folder` belongs to the store. Maps that an earlier run left there are taken where it was made from the same `key`,
  // a text of a line for each thing; else they are removed. `bytes`: of maps in memory; two are kept in any case.
  // part: the store is of one of several processes that fill the folder together. Throws UsageError where maps that
  // were made in parts, or are there for a part, have another key.
  DepthStore(std::filesystem::path folder, const std::string& key, std::size_t bytes, std::optional<Part> part = {});

  // The last round (0 ... rounds - 1) of which a photo has a map; -1: there is none.
  int LastRound(const std::string& photo, int rounds) const;
  bool Has(const std::string& photo, int round) const;
  // Whether the maps are what runs leave, finished or killed, whole or in parts: from the least last round of all
  // photos on, each photo has the maps of all rounds up to its last.
  bool IsWhole(const std::vector<std::string>& photos, int rounds) const;
  void RemoveAll(const std::vector<std::string>& photos, int rounds);
  // All maps are there: the folder is as one run leaves it.
  void ForgetParts() const { files_.ForgetParts(); }
  // The photos' maps of their last rounds are on the disk, also after losing power.
  void Flush(const std::vector<std::string>& photos, int rounds) const;
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
  void RemoveDamaged();  // that losing power left incomplete
  void Hold(const Key& key, std::shared_ptr<const DepthMap> map);

  std::filesystem::path folder_;
  FilledInParts files_;
  std::size_t bytes_, held_bytes_ = 0;
  std::list<Held> held_;  // the last used first
};

}  // namespace lumi
