// The photographs as array textures: one layer a photo, its pyramid in the layer's upper-left corner, so that the GPU
// reads the very texels that the CPU does. Where not all of them fit, there are layers for some whole photos and for
// more halved ones, and photos come and go (PhotoSlots).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "render/gl/gl_objects.h"
#include "render/photos/photo_set.h"
#include "render/photos/photo_slots.h"

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
  bool small_copy = false;  // where it lies for good (UploadSmallCopy)
};

// Needs a current context.
class PhotoTextures {
 public:
  // sizes_px: level 0 of each photo as it will be uploaded. There is room for all of them from now on; photos that take
  // more than `bytes` together are not all held: see kinds() and rooms(). Unless small_halvings is negative, copies of
  // all of them that are halved so often are, as part of these bytes. Throws MachineError where that many photos of
  // that many sizes cannot be held at once, or graphics memory is full.
  explicit PhotoTextures(const std::vector<Eigen::Vector2i>& sizes_px,
                         std::size_t bytes = std::numeric_limits<std::size_t>::max(), int small_halvings = -1);

  // Throws std::invalid_argument for a photo larger than was planned, std::logic_error where there is no layer for it
  // (PhotoSlots), MachineError when memory is full.
  void Upload(std::size_t index, const Photo& photo);
  void Drop(std::size_t index);  // its small copy stays
  // Stands in for the photo while it is not there. The copy is halved as often as was planned.
  void UploadSmallCopy(std::size_t index, const Photo& copy);

  // For PhotoSlots: what kind each photo is of, and the layers of each kind.
  const std::vector<int>& kinds() const { return kinds_; }
  const std::vector<PhotoRoom>& rooms() const { return rooms_; }
  bool holds_all() const { return holds_all_; }

  const std::vector<PhotoPlace>& places() const { return places_; }
  int group_count() const { return static_cast<int>(groups_.size()); }
  Eigen::Vector2i GroupSize(int group) const { return groups_[static_cast<std::size_t>(group)].size_px; }
  // Whether each photo that is loaded fills its texture, and its pyramid the texture's.
  bool WholeLayers() const;
  // Binds group g to texture unit first_unit + g.
  void Bind(int first_unit) const;
  std::size_t bytes_loaded() const { return bytes_loaded_; }  // of the photos that are loaded, 4 bytes a texel

 private:
  struct Layer {
    int group = 0, layer = 0;
  };
  struct Group {
    Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
    int layers = 0;
    int levels = 0;
    GlTexture texture;
  };
  void AddGroups(const Eigen::Vector2i& size_px, int layers, int layers_a_texture, std::vector<Layer>& free);
  static void MakeRoom(Group& group);
  std::vector<Layer>& FreeLayers(std::size_t index, const Eigen::Vector2i& size_px);
  void TakeLayer(std::size_t index, const Eigen::Vector2i& size_px);
  void Fill(PhotoPlace& place, const Photo& photo);
  // Of photos of one size, about.
  struct Kind {
    Eigen::Vector2i whole_px = Eigen::Vector2i::Zero();
    std::array<std::vector<Layer>, kSlotSizes> free;  // the last one is taken first
  };
  std::vector<Group> groups_;
  std::vector<PhotoPlace> places_, small_copies_;
  std::vector<Eigen::Vector2i> planned_px_;
  std::vector<int> kinds_;
  std::vector<Kind> of_kind_;
  std::vector<PhotoRoom> rooms_;
  bool holds_all_ = true;
  std::size_t bytes_loaded_ = 0;
};

// Texture units that a shader needs beside the photos'.
constexpr int kReservedTextureUnits = 7;

}  // namespace lumi
