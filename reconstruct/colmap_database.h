// A COLMAP database (SQLite): which photos have features, and what matched. Read through SQLite, never through COLMAP.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "reconstruct/pair_geometry.h"
#include "scene/model/camera.h"
#include "scene/tracks/sift.h"

namespace lumi {

struct DatabaseImage {
  std::int64_t id = 0;
  std::int64_t camera_id = 0;
  std::string name;
  int keypoints = 0;
};

struct DatabaseCamera {
  std::int64_t id = 0;
  Camera camera;
  bool focal_is_known = false;  // by EXIF or the user, not guessed
};

struct DatabasePair {
  std::int64_t image1 = 0, image2 = 0;
  int matches = 0;
};

// A photo with its features, as it is written.
struct DatabasePhoto {
  std::int64_t id = 0;
  std::int64_t camera_id = 0;    // where it has no camera of its own
  std::optional<Camera> camera;  // of its own, whose focal length is guessed
  std::string name;
  std::vector<SiftFeature> features;
  ByteDescriptors descriptors;
};

// A pair that was matched, as it is written: positions in the keypoints of image1 and image2, image1 < image2.
struct DatabaseMatches {
  std::int64_t image1 = 0, image2 = 0;
  std::vector<std::pair<int, int>> matches;
  PairGeometry geometry;  // of what is left after verification
};

// Of a pair's verified matches those that are to stay, image1 < image2.
struct VerifiedMatchesLeft {
  std::int64_t image1 = 0, image2 = 0;
  std::vector<std::pair<int, int>> matches;
};

class ColmapDatabase {
 public:
  // kOurs: what a killed run left in the journal is recovered, SetCameras works. kTheirs: nothing is written, not even
  // a journal beside it.
  enum class Access { kOurs, kTheirs };
  // Throws InputError when the file is no COLMAP database.
  explicit ColmapDatabase(const std::filesystem::path& path, Access access = Access::kOurs);
  ~ColmapDatabase();
  ColmapDatabase(ColmapDatabase&&) noexcept;
  static bool IsDatabase(const std::filesystem::path& path, Access access = Access::kOurs);

  // Whether its pages fit together. COLMAP writes without waiting for the disk: what losing power left may not.
  bool IsWhole() const;
  std::vector<DatabaseImage> Images() const;        // sorted by name
  std::vector<DatabasePair> MatchedPairs() const;   // pairs that were tried, raw matches counted
  std::vector<DatabasePair> VerifiedPairs() const;  // pairs with geometrically verified matches
  // Pixels of an image's features, COLMAP's convention (the upper-left pixel's centre at (0.5, 0.5)).
  std::vector<Eigen::Vector2d> Keypoints(std::int64_t image_id) const;
  // SIFT descriptors of an image's features, shape (features, 128), as COLMAP rounds them: 512 times a unit vector.
  ByteDescriptors Descriptors(std::int64_t image_id) const;
  // Raw matches of a pair: positions in the keypoints of image1 and image2.
  std::vector<std::pair<int, int>> Matches(std::int64_t image1, std::int64_t image2) const;
  // Those of them that a pair's verified geometry explains.
  std::vector<std::pair<int, int>> VerifiedMatches(std::int64_t image1, std::int64_t image2) const;
  std::vector<DatabaseCamera> Cameras() const;  // of models that scenes are kept in
  // The images of these numbers are called so from now on.
  void Rename(const std::map<std::int64_t, std::string>& name_of_image);
  bool HasRigs() const;  // COLMAP 3.12 and later: cameras belong to rigs, and cannot be rewritten here

  // Replaces all cameras: `camera_of_image` maps image ids to positions in `cameras`. One transaction.
  void SetCameras(const std::vector<Camera>& cameras, bool focal_is_known,
                  const std::map<std::int64_t, std::size_t>& camera_of_image);
  // The parameters of one, whose focal length counts as known from now on.
  void SetFocalLength(std::int64_t camera_id, const Camera& camera);

  // What a killed run leaves is whole photos, and whole batches of pairs: one transaction a call. Databases with rigs
  // (HasRigs) want more rows than these two write. AddPhoto returns the camera's id.
  std::int64_t AddPhoto(const DatabasePhoto& photo);
  void AddPairs(const std::vector<DatabaseMatches>& pairs);

  // A new file with the same rows, in a folder where a killed run left no journal of one of that name.
  void CopyTo(const std::filesystem::path& path) const;
  void KeepOfVerified(const std::vector<VerifiedMatchesLeft>& pairs);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumi
