#include "render/gl/photo_textures.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <stdexcept>
#include <string>

#include "scene/program/error.h"

namespace lumi {
namespace {

// llvmpipe refuses textures beyond 2 GiB; a third of a pyramid is above level 0.
constexpr std::size_t kMaxTextureBytes = std::size_t(3) << 29;

struct SizeClass {
  Eigen::Vector2i size_px;
  std::vector<std::size_t> photos;
};

std::size_t LayerBytes(const Eigen::Vector2i& size) {
  return static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) * 16 / 3;
}

// Throws std::invalid_argument for what does not fit into a layer of this size.
void Check(const Photo& photo, const Eigen::Vector2i& most_px) {
  if (photo.levels.empty()) throw std::invalid_argument("PhotoTextures: the photo is not loaded");
  const Image8& first = photo.levels.front();
  if (first.width > most_px.x() || first.height > most_px.y() || first.channels != 3)
    throw std::invalid_argument("PhotoTextures: a photo of another size or channel count than was planned");
  for (std::size_t l = 0; l < photo.levels.size(); ++l)
    if (photo.levels[l].width != std::max(1, first.width >> l) ||
        photo.levels[l].height != std::max(1, first.height >> l))
      throw std::invalid_argument("PhotoTextures: a pyramid level is not half of the one before");
}

int LayersPerTexture(const Eigen::Vector2i& size, int max_layers) {
  return static_cast<int>(std::clamp<std::size_t>(kMaxTextureBytes / std::max<std::size_t>(LayerBytes(size), 1), 1,
                                                  static_cast<std::size_t>(max_layers)));
}

std::size_t BytesOf(const std::vector<SizeClass>& classes, int halvings = 0) {
  std::size_t bytes = 0;
  for (const SizeClass& c : classes) bytes += LayerBytes(HalvedSize(c.size_px, halvings)) * c.photos.size();
  return bytes;
}

// Layers for the photos of a class: all, or a share of `bytes` by what they would take.
PhotoRoom RoomOf(const SizeClass& c, std::size_t bytes, std::size_t all) {
  constexpr std::array<double, kSlotSizes> kShares = {0.6, 0.25, 0.15};  // of the bytes
  const int photos = static_cast<int>(c.photos.size());
  if (all <= bytes) return {photos, 0, 0};
  const double share = static_cast<double>(bytes) * static_cast<double>(LayerBytes(c.size_px) * c.photos.size()) /
                       static_cast<double>(all);
  PhotoRoom room{};
  for (int h = 0; h < kSlotSizes; ++h) {
    const auto i = static_cast<std::size_t>(h);
    const double layers = kShares[i] * share / static_cast<double>(LayerBytes(HalvedSize(c.size_px, h)));
    room[i] = std::clamp(static_cast<int>(layers), 1, photos);
  }
  return room;
}

int TextureCount(const std::vector<SizeClass>& classes, int max_layers, std::size_t bytes, int small_halvings) {
  const auto textures = [&](int layers, const Eigen::Vector2i& size) {
    const int per = LayersPerTexture(size, max_layers);
    return (layers + per - 1) / per;
  };
  int n = 0;
  for (const SizeClass& c : classes) {
    const PhotoRoom room = RoomOf(c, bytes, BytesOf(classes));
    for (int h = 0; h < kSlotSizes; ++h) n += textures(room[static_cast<std::size_t>(h)], HalvedSize(c.size_px, h));
    if (small_halvings >= 0) n += textures(static_cast<int>(c.photos.size()), HalvedSize(c.size_px, small_halvings));
  }
  return n;
}

// Merges the two classes whose merging wastes least memory.
void MergeCheapest(std::vector<SizeClass>& classes) {
  std::size_t best_a = 0, best_b = 1;
  double best = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < classes.size(); ++a)
    for (std::size_t b = a + 1; b < classes.size(); ++b) {
      const Eigen::Vector2i joint = classes[a].size_px.cwiseMax(classes[b].size_px);
      const auto bytes = [](const Eigen::Vector2i& size, std::size_t n) {
        return static_cast<double>(LayerBytes(size)) * static_cast<double>(n);
      };
      const double waste = bytes(joint, classes[a].photos.size() + classes[b].photos.size()) -
                           bytes(classes[a].size_px, classes[a].photos.size()) -
                           bytes(classes[b].size_px, classes[b].photos.size());
      if (waste < best) {
        best = waste;
        best_a = a;
        best_b = b;
      }
    }
  classes[best_a].size_px = classes[best_a].size_px.cwiseMax(classes[best_b].size_px).eval();
  auto& into = classes[best_a].photos;
  into.insert(into.end(), classes[best_b].photos.begin(), classes[best_b].photos.end());
  classes.erase(classes.begin() + static_cast<std::ptrdiff_t>(best_b));
}

std::size_t TexelBytes(const PhotoPlace& place) {
  std::size_t texels = 0;
  for (int l = 0; l <= place.top_level; ++l)
    texels += static_cast<std::size_t>(std::max(1, place.size_px.x() >> l)) *
              static_cast<std::size_t>(std::max(1, place.size_px.y() >> l));
  return 4 * texels;
}

}  // namespace

PhotoTextures::PhotoTextures(const std::vector<Eigen::Vector2i>& sizes_px, std::size_t bytes, int small_halvings)
    : places_(sizes_px.size()), small_copies_(sizes_px.size()), planned_px_(sizes_px), kinds_(sizes_px.size()) {
  GLint max_layers = 256, units = 16, compute_units = 16, max_size = 4096;
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &max_layers);
  glGetIntegerv(GL_MAX_TEXTURE_IMAGE_UNITS, &units);
  glGetIntegerv(GL_MAX_COMPUTE_TEXTURE_IMAGE_UNITS, &compute_units);
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_size);
  const int max_groups = std::min(std::min(units, compute_units) - kReservedTextureUnits, kMaxPhotoGroups);
  max_layers = std::min(max_layers, kMaxPhotoLayers);

  std::vector<SizeClass> classes;
  for (std::size_t i = 0; i < sizes_px.size(); ++i) {
    if (sizes_px[i].maxCoeff() > max_size)
      throw MachineError("a photo of " + std::to_string(sizes_px[i].x()) + "x" + std::to_string(sizes_px[i].y()) +
                             " is larger than this driver's textures (" + std::to_string(max_size) + ")",
                         "halve the photos, or use --backend cpu");
    const auto same =
        std::find_if(classes.begin(), classes.end(), [&](const SizeClass& c) { return c.size_px == sizes_px[i]; });
    if (same != classes.end())
      same->photos.push_back(i);
    else
      classes.push_back({sizes_px[i], {i}});
  }
  // Merging makes layers larger: what fits is decided for the classes as they are.
  const auto planned_copies = [&] { return BytesOf(classes) <= bytes ? -1 : small_halvings; };
  const auto slot_bytes = [&] {
    return planned_copies() < 0 ? bytes : bytes - std::min(bytes, BytesOf(classes, planned_copies()));
  };
  const auto too_many = [&] { return TextureCount(classes, max_layers, slot_bytes(), planned_copies()) > max_groups; };
  while (classes.size() > 1 && too_many()) MergeCheapest(classes);
  if (too_many())
    throw MachineError(std::to_string(sizes_px.size()) + " photos of this size do not fit into " +
                           std::to_string(max_groups) + " textures",
                       "use smaller photos, or --backend cpu");

  const std::size_t all = BytesOf(classes);
  holds_all_ = all <= bytes;
  small_halvings = planned_copies();
  bytes = slot_bytes();
  for (const SizeClass& c : classes) {
    const PhotoRoom room = RoomOf(c, bytes, all);
    Kind kind;
    kind.whole_px = c.size_px;
    for (int h = 0; h < kSlotSizes; ++h) {
      const auto i = static_cast<std::size_t>(h);
      const Eigen::Vector2i size_px = HalvedSize(c.size_px, h);
      AddGroups(size_px, room[i], LayersPerTexture(size_px, max_layers), kind.free[i]);
    }
    for (const std::size_t photo : c.photos) kinds_[photo] = static_cast<int>(rooms_.size());
    if (small_halvings >= 0) {
      const Eigen::Vector2i copy_px = HalvedSize(c.size_px, small_halvings);
      std::vector<Layer> copies;
      AddGroups(copy_px, static_cast<int>(c.photos.size()), LayersPerTexture(copy_px, max_layers), copies);
      for (const std::size_t photo : c.photos) {
        small_copies_[photo].group = copies.back().group;
        small_copies_[photo].layer = copies.back().layer;
        copies.pop_back();
      }
    }
    rooms_.push_back(room);
    of_kind_.push_back(std::move(kind));
  }
  for (Group& group : groups_) MakeRoom(group);
}

// Before the first picture: drivers that compile a shader for the textures it reads (llvmpipe, a quarter of a second)
// would do it again for each that comes.
void PhotoTextures::MakeRoom(Group& group) {
  group.levels = std::bit_width(static_cast<unsigned>(group.size_px.maxCoeff()));
  group.texture = GlTexture::Make();
  glBindTexture(GL_TEXTURE_2D_ARRAY, group.texture.id());
  glTexStorage3D(GL_TEXTURE_2D_ARRAY, group.levels, GL_RGBA8, group.size_px.x(), group.size_px.y(), group.layers);
  // For photos smaller than the texture the shader mixes two levels itself, each with its own border.
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  CheckGl("making room for photos");
}

void PhotoTextures::AddGroups(const Eigen::Vector2i& size_px, int layers, int layers_a_texture,
                              std::vector<Layer>& free) {
  for (int i = 0; i < layers; ++i) {
    if (i % layers_a_texture == 0) {
      groups_.emplace_back();
      groups_.back().size_px = size_px;
    }
    free.push_back({group_count() - 1, groups_.back().layers++});
  }
  std::reverse(free.begin(), free.end());
}

std::vector<PhotoTextures::Layer>& PhotoTextures::FreeLayers(std::size_t index, const Eigen::Vector2i& size_px) {
  Kind& kind = of_kind_[static_cast<std::size_t>(kinds_[index])];
  // The smallest slot that it fits into; a photo of a pixel fits all alike.
  std::size_t h = 0;
  if (!holds_all_)
    while (h + 1 < kind.free.size()) {
      const Eigen::Vector2i next = HalvedSize(planned_px_[index], static_cast<int>(h) + 1);
      if (next == HalvedSize(planned_px_[index], static_cast<int>(h)) || (size_px.array() > next.array()).any()) break;
      ++h;
    }
  return kind.free[h];
}

void PhotoTextures::TakeLayer(std::size_t index, const Eigen::Vector2i& size_px) {
  PhotoPlace& place = places_[index];
  if (place.loaded && place.size_px == size_px && !place.small_copy) return;
  Drop(index);
  std::vector<Layer>& free = FreeLayers(index, size_px);
  if (free.empty()) throw std::logic_error("PhotoTextures: there is no layer left for a photo");
  place = {};
  place.group = free.back().group;
  place.layer = free.back().layer;
  free.pop_back();
}

void PhotoTextures::Drop(std::size_t index) {
  PhotoPlace& place = places_.at(index);
  if (!place.loaded || place.small_copy) return;
  FreeLayers(index, place.size_px).push_back({place.group, place.layer});
  bytes_loaded_ -= TexelBytes(place);
  place = small_copies_[index];
}

void PhotoTextures::UploadSmallCopy(std::size_t index, const Photo& copy) {
  if (holds_all_ || groups_.empty()) throw std::logic_error("PhotoTextures: no small copies were planned");
  PhotoPlace& place = small_copies_.at(index);
  Check(copy, groups_[static_cast<std::size_t>(place.group)].size_px);
  place.small_copy = true;
  Fill(place, copy);
  if (!places_[index].loaded || places_[index].small_copy) places_[index] = place;
}

void PhotoTextures::Upload(std::size_t index, const Photo& photo) {
  Check(photo, of_kind_.at(static_cast<std::size_t>(kinds_.at(index))).whole_px);
  TakeLayer(index, {photo.levels.front().width, photo.levels.front().height});
  Fill(places_[index], photo);
}

void PhotoTextures::Fill(PhotoPlace& place, const Photo& photo) {
  const Image8& first = photo.levels.front();
  Group& group = groups_[static_cast<std::size_t>(place.group)];
  glBindTexture(GL_TEXTURE_2D_ARRAY, group.texture.id());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  // A pyramid's level is half the one before, rounded down, as GL's own: it fits into the texture's level.
  const int levels = std::min(static_cast<int>(photo.levels.size()), group.levels);
  for (int l = 0; l < levels; ++l) {
    const Image8& image = photo.levels[static_cast<std::size_t>(l)];
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, l, 0, 0, place.layer, image.width, image.height, 1, GL_RGB, GL_UNSIGNED_BYTE,
                    image.data.data());
  }
  CheckGl("uploading a photo");
  const bool again = place.loaded;
  place.size_px = {first.width, first.height};
  place.top_level = levels - 1;
  if (!again) bytes_loaded_ += TexelBytes(place);
  place.shift = photo.level0_shift;
  place.loaded = true;
}

bool PhotoTextures::WholeLayers() const {
  return std::all_of(places_.begin(), places_.end(), [&](const PhotoPlace& p) {
    const Group& group = groups_[static_cast<std::size_t>(p.group)];
    return !p.loaded || (p.size_px == group.size_px && p.top_level + 1 == group.levels);
  });
}

void PhotoTextures::Bind(int first_unit) const {
  for (int g = 0; g < group_count(); ++g) {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + first_unit + g));
    glBindTexture(GL_TEXTURE_2D_ARRAY, groups_[static_cast<std::size_t>(g)].texture.id());
  }
}

}  // namespace lumi
