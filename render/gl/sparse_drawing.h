// A SparsePlan in graphics memory: its triangles' corners, and each photo of each triangle projected at the corners.
// Needs a current context.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/gl/gl_objects.h"
#include "render/gl/photo_textures.h"
#include "render/gl/sparse_shader.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/sparse/candidate_plan.h"
#include "render/radiance/sparse/sparse_plan.h"

namespace lumi {

class SparseDrawing {
 public:
  // Replaces what was there. `views`: the cameras as they were packed (PackCameras); photos that are not among them
  // have no weight. `base`: the variant, without the fields that depend on a triangle. Throws MachineError where the
  // driver's buffers are too small.
  void Upload(const SparsePlan& plan, const ViewSetup& setup, std::span<const int> views, const PhotoTextures& photos,
              const SparseVariant& base);

  // Triangles that one program draws.
  struct Batch {
    SparseVariant variant;
    int first_vertex = 0, vertex_count = 0;
  };
  const std::vector<Batch>& batches() const { return batches_; }
  // Whether triangles may lie over others.
  bool overlapping() const { return overlapping_; }
  unsigned vertex_array() const { return vertex_array_.id(); }
  unsigned projection_texture() const { return projection_texture_.id(); }
  unsigned place_texture() const { return place_texture_.id(); }

 private:
  // As the buffers hold them (sparse_shader.h).
  struct Corner {
    float x = 0, y = 0, z = 0, inverse_depth = 0;
    std::uint32_t first = 0, last = 0;
  };
  using Projections = std::array<Eigen::Vector4f, 3>;

  std::vector<Corner> corners_;
  std::vector<Projections> projections_;
  std::vector<std::uint32_t> places_;
  std::vector<Batch> batches_;
  bool overlapping_ = false;
  GlVertexArray vertex_array_;
  GlBuffer corner_buffer_, projection_buffer_, place_buffer_;
  GlTexture projection_texture_, place_texture_;
};

// Lines over a picture (Show::kTessellation): a plan's triangles, or a plan's cells; and crosses at the epipole
// samples.
class PlanLines {
 public:
  void Clear() { lines_.clear(); }
  void Set(const SparsePlan& plan, const Eigen::Vector2i& size_px);
  void Set(const CandidatePlan& plan, const Eigen::Vector2i& size_px);
  bool empty() const { return lines_.empty(); }
  // Draws with the program that is in use.
  void Draw();

 private:
  struct End {
    float x, y, r, g, b, a;
  };
  void Add(const Eigen::Vector2i& size_px, const Eigen::Vector2f& a, const Eigen::Vector2f& b,
           const Eigen::Vector4f& rgba);
  void AddCrosses(const Eigen::Vector2i& size_px, const std::vector<Eigen::Vector2f>& at);
  void Upload();
  std::vector<End> lines_;
  GlVertexArray vertex_array_;
  GlBuffer buffer_;
};

}  // namespace lumi
