// Depth maps of all photos while stereo works: on disk as they are finished, so that a killed run goes on, and the last
// ones used in memory, up to a bound.
#pragma once

#include <cstdint>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "proxy/dense/depth_map.h"

namespace lumi {

class DepthStore {
 public:
  // What is in a store's folder: the key, and maps.
  static constexpr const char* kMadeFrom = "made-from.txt";
  static std::string FileName(const std::string& photo, int round);

  // `folder` belongs to the store. Maps that an earlier run left there are taken where it was made from the same `key`,
  // else they are removed. `bytes`: of maps in memory; two are kept in any case.
  DepthStore(std::filesystem::path folder, const std::string& key, std::size_t bytes);

  // Whether the map of a photo after a round (0 ...) is there, or of a later one.
  bool Done(const std::string& photo, int round, int rounds) const;
  // Removes all maps, unless they are what a finished or killed run leaves: one round's maps of all photos, and the
  // next round's maps of some.
  void ForgetUnlessWhole(const std::vector<std::string>& photos, int rounds);
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
  std::size_t bytes_, held_bytes_ = 0;
  std::list<Held> held_;  // the last used first
};

}  // namespace lumi
