// The photographs as array textures: one layer a photo, its pyramid in the layer's upper-left corner, so that the GPU
// reads the very texels that the CPU does.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "render/gl/gl_objects.h"
#include "render/photos/photo_set.h"

namespace lumi {

// Limits chosen so that a photo's group and layer fit into 16 bits (RecordPlace).
constexpr int kMaxPhotoGroups = 32, kMaxPhotoLayers = 2048;

// Where a photo lies.
struct PhotoPlace {
  int group = 0;  // of PhotoTextures
  int layer = 0;
  Eigen::Vector2i size_px = Eigen::Vector2i::Zero();  // of level 0 in memory
  int top_level = 0;                                  // its pyramid's last
  int shift = 0;                                      // Photo::level0_shift
  bool loaded = false;
};

// Needs a current context.
class PhotoTextures {
 public:
  // sizes_px: level 0 of each photo as it will be uploaded. Nothing is allocated yet. Throws MachineError where that
  // many photos of that many sizes cannot be held at once.
  explicit PhotoTextures(const std::vector<Eigen::Vector2i>& sizes_px);

  // Throws std::invalid_argument for a photo larger than was planned, MachineError when memory is full.
  void Upload(std::size_t index, const Photo& photo);

  const std::vector<PhotoPlace>& places() const { return places_; }
  int group_count() const { return static_cast<int>(groups_.size()); }
  Eigen::Vector2i GroupSize(int group) const { return groups_[static_cast<std::size_t>(group)].size_px; }
  // Whether each photo that is loaded fills its texture, and its pyramid the texture's.
  bool WholeLayers() const;
  // Binds group g to texture unit first_unit + g.
  void Bind(int first_unit) const;
  std::size_t bytes_loaded() const { return bytes_loaded_; }  // texels that were uploaded, 4 bytes each

 private:
  struct Group {
    Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
    int layers = 0;
    int levels = 0;     // of the tallest pyramid in it
    GlTexture texture;  // made with its first photo
  };
  std::vector<Group> groups_;
  std::vector<PhotoPlace> places_;
  std::size_t bytes_loaded_ = 0;
};

// Texture units that a shader needs beside the photos'.
constexpr int kReservedTextureUnits = 7;

}  // namespace lumi
