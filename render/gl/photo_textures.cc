#include "render/gl/photo_textures.h"

#include <epoxy/gl.h>

#include <algorithm>
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

int LayersPerTexture(const Eigen::Vector2i& size, int max_layers) {
  return static_cast<int>(std::clamp<std::size_t>(kMaxTextureBytes / std::max<std::size_t>(LayerBytes(size), 1), 1,
                                                  static_cast<std::size_t>(max_layers)));
}

int TextureCount(const std::vector<SizeClass>& classes, int max_layers) {
  int n = 0;
  for (const SizeClass& c : classes) {
    const int per = LayersPerTexture(c.size_px, max_layers);
    n += (static_cast<int>(c.photos.size()) + per - 1) / per;
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

}  // namespace

PhotoTextures::PhotoTextures(const std::vector<Eigen::Vector2i>& sizes_px) : places_(sizes_px.size()) {
  GLint max_layers = 256, units = 16, max_size = 4096;
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &max_layers);
  glGetIntegerv(GL_MAX_TEXTURE_IMAGE_UNITS, &units);
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_size);
  const int max_groups = std::min(units - kReservedTextureUnits, kMaxPhotoGroups);
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
  while (classes.size() > 1 && TextureCount(classes, max_layers) > max_groups) MergeCheapest(classes);
  if (TextureCount(classes, max_layers) > max_groups)
    throw MachineError(std::to_string(sizes_px.size()) + " photos of this size do not fit into " +
                           std::to_string(max_groups) + " textures",
                       "use smaller photos, or --backend cpu");

  for (const SizeClass& c : classes) {
    const int per = LayersPerTexture(c.size_px, max_layers);
    for (std::size_t i = 0; i < c.photos.size(); ++i) {
      if (static_cast<int>(i) % per == 0) {
        groups_.emplace_back();
        groups_.back().size_px = c.size_px;
      }
      PhotoPlace& place = places_[c.photos[i]];
      place.group = group_count() - 1;
      place.layer = groups_.back().layers++;
    }
  }
}

void PhotoTextures::Upload(std::size_t index, const Photo& photo) {
  if (photo.levels.empty()) throw std::invalid_argument("PhotoTextures: the photo is not loaded");
  PhotoPlace& place = places_.at(index);
  Group& group = groups_[static_cast<std::size_t>(place.group)];
  const Image8& first = photo.levels.front();
  if (first.width > group.size_px.x() || first.height > group.size_px.y() || first.channels != 3)
    throw std::invalid_argument("PhotoTextures: a photo of another size or channel count than was planned");

  const GLint level_count = std::bit_width(static_cast<unsigned>(group.size_px.maxCoeff()));
  if (!group.texture) {
    group.texture = GlTexture::Make();
    glBindTexture(GL_TEXTURE_2D_ARRAY, group.texture.id());
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, level_count, GL_RGBA8, group.size_px.x(), group.size_px.y(), group.layers);
    // For photos smaller than the texture the shader mixes two levels itself, each with its own border.
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    CheckGl("making room for photos");
  }
  glBindTexture(GL_TEXTURE_2D_ARRAY, group.texture.id());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  // A pyramid's level is half the one before, rounded down, as GL's own: it fits into the texture's level.
  const int levels = std::min(static_cast<int>(photo.levels.size()), level_count);
  std::size_t bytes = 0;
  for (int l = 0; l < levels; ++l) {
    const Image8& image = photo.levels[static_cast<std::size_t>(l)];
    if (image.width != std::max(1, first.width >> l) || image.height != std::max(1, first.height >> l))
      throw std::invalid_argument("PhotoTextures: a pyramid level is not half of the one before");
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, l, 0, 0, place.layer, image.width, image.height, 1, GL_RGB, GL_UNSIGNED_BYTE,
                    image.data.data());
    bytes += static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4;
  }
  CheckGl("uploading a photo");
  if (!place.loaded) bytes_loaded_ += bytes;
  place.size_px = {first.width, first.height};
  place.top_level = levels - 1;
  if (levels > group.levels) {
    group.levels = levels;
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, levels - 1);
  }
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
