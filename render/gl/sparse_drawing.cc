#include "render/gl/sparse_drawing.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <string>
#include <utility>

#include "render/radiance/measures/prefilter.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// As the CPU's overlay.
const Eigen::Vector4f kEdgeColor(1.0F, 1.0F, 1.0F, 0.65F);
const Eigen::Vector4f kEpipoleColor(1.0F, 0.15F, 0.1F, 1.0F);
constexpr float kCrossPx = 5;

Eigen::Vector2f ClipFromPixel(const Eigen::Vector2f& x_px, const Eigen::Vector2i& size_px) {
  return (2 * x_px.array() / size_px.cast<float>().array() - 1).matrix();
}

struct Source {
  int packed = -1;  // among the uploaded photos
  Eigen::Matrix3f M;
  Eigen::Vector3f centre;
  float footprint = 1;
  std::uint32_t place = 0;
};

std::vector<Source> SourcesOf(const ViewSetup& setup, std::span<const int> views, const PhotoTextures& photos) {
  const RelativeSources& s = setup.sources;
  std::vector<Source> sources(static_cast<std::size_t>(s.count));
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto j = static_cast<std::size_t>(views[i]);
    Source& p = sources[j];
    p.packed = static_cast<int>(i);
    for (int r = 0; r < 9; ++r) p.M(r / 3, r % 3) = s.m[r][j];
    p.M.row(0) /= s.width_px[j];
    p.M.row(1) /= s.height_px[j];
    p.centre = {s.dx[j], s.dy[j], s.dz[j]};
    const PhotoPlace& place = photos.places()[j];
    p.place = RecordPlace(p.packed, place.group, place.layer);
    // Photo pixels a pixel at equal depths, a plane that faces both alike, and level 0.
    p.footprint = s.focal_px[j] / setup.focal_px * std::exp2(kLevelBias - static_cast<float>(place.shift));
  }
  return sources;
}

}  // namespace

void SparseDrawing::Upload(const SparsePlan& plan, const ViewSetup& setup, std::span<const int> views,
                           const PhotoTextures& photos, const SparseVariant& base) {
  if (views.size() > kMaxRecordCameras)
    throw MachineError(std::to_string(views.size()) + " photos are more than sparse samples can tell apart here",
                       "use --grid pixel, or --backend cpu");
  const Eigen::Vector3f axis = setup.desired.P.row(2).head<3>().transpose().cast<float>();
  const std::vector<Source> sources = SourcesOf(setup, views, photos);

  // Sorts triangles by the program that draws them: by number of layers, and by whether photos end in them.
  projections_.clear();
  places_.clear();
  overlapping_ = false;
  const std::size_t n = plan.triangles.size();
  std::vector<std::uint32_t> first(n + 1);
  std::vector<std::uint8_t> kind_of(n);
  constexpr std::size_t kKinds = 2 * (kMaxLayers + 1);
  std::array<std::size_t, kKinds> count{};
  for (std::size_t i = 0; i < n; ++i) {
    const SparseTriangle& triangle = plan.triangles[i];
    overlapping_ |= !triangle.alone;
    std::array<Eigen::Vector3f, 3> x;
    std::array<float, 3> inverse_depth;
    for (std::size_t v = 0; v < 3; ++v) {
      x[v] = plan.offset[static_cast<std::size_t>(triangle.vertex[v])];
      inverse_depth[v] = 1 / std::max(axis.dot(x[v]), kNearDepth);
    }
    const Eigen::Vector3f normal = (x[1] - x[0]).cross(x[2] - x[0]).stableNormalized();
    const float view_facing = normal.dot(x[0]);
    for (std::int32_t e = triangle.first; e < triangle.first + triangle.count; ++e) {
      const Source& p = sources[static_cast<std::size_t>(plan.camera[static_cast<std::size_t>(e)])];
      if (p.packed < 0) continue;
      places_.push_back(p.place);
      Projections& q = projections_.emplace_back();
      // -1.5 log2 of the third coordinate is the level (sparse_shader.cc): footprint * sqrt(facing) at depths alike.
      const float facing = FacingRatio(normal.dot(x[0] - p.centre), view_facing);
      const float scale = 1 / std::cbrt(p.footprint * p.footprint * facing);
      for (std::size_t v = 0; v < 3; ++v)
        q[v] << scale * p.M * (x[v] - p.centre) * inverse_depth[v], plan.weight[static_cast<std::size_t>(e)][v];
    }
    first[i + 1] = static_cast<std::uint32_t>(places_.size());
    // Drivers compile many unrolled look-ups slowly: photos in parts of layers are drawn by the shader with a loop.
    const int layers =
        base.blend.whole_layers || base.blend.false_color ? LayersFor(static_cast<int>(first[i + 1] - first[i])) : 0;
    const std::size_t kind = 2 * static_cast<std::size_t>(layers) + (triangle.inside ? 0U : 1U);
    kind_of[i] = static_cast<std::uint8_t>(kind);
    ++count[kind];
  }

  batches_.clear();
  std::array<std::size_t, kKinds> next{};
  std::size_t total = 0;
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    next[kind] = total;
    if (count[kind] == 0) continue;
    Batch batch{base, static_cast<int>(total), static_cast<int>(3 * count[kind])};
    batch.variant.layers = static_cast<int>(kind / 2);
    if (kind % 2 == 0) batch.variant.ends = PhotoEnds::kNever;
    batches_.push_back(batch);
    total += 3 * count[kind];
  }
  corners_.resize(total);
  for (std::size_t i = 0; i < n; ++i)
    for (const std::int32_t v : plan.triangles[i].vertex) {
      const auto vertex = static_cast<std::size_t>(v);
      Corner& c = corners_[next[kind_of[i]]++];
      const Eigen::Vector2f clip = ClipFromPixel(plan.x_px[vertex], setup.desired.size_px);
      const float depth = std::max(axis.dot(plan.offset[vertex]), kNearDepth);
      c = {clip.x(), clip.y(), kNearDepth / depth, 1 / depth, first[i], first[i + 1]};
    }

  GLint limit = 65536;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &limit);
  if (3 * places_.size() > static_cast<std::size_t>(limit))
    throw MachineError("this driver's texture buffers hold " + std::to_string(limit / 3) +
                           " photos of triangles; the plan has " + std::to_string(places_.size()),
                       "use a smaller --grid or --k, or --backend cpu");
  if (!vertex_array_) {
    vertex_array_ = GlVertexArray::Make();
    corner_buffer_ = GlBuffer::Make();
    glBindVertexArray(vertex_array_.id());
    glBindBuffer(GL_ARRAY_BUFFER, corner_buffer_.id());
    const auto at = [](std::size_t offset) { return reinterpret_cast<const void*>(offset); };
    for (GLuint i = 0; i < 3; ++i) glEnableVertexAttribArray(i);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Corner), at(offsetof(Corner, x)));
    glVertexAttribPointer(1, 1, GL_FLOAT, GL_FALSE, sizeof(Corner), at(offsetof(Corner, inverse_depth)));
    glVertexAttribIPointer(2, 2, GL_UNSIGNED_INT, sizeof(Corner), at(offsetof(Corner, first)));
    glBindVertexArray(0);
  }
  FillBuffer(GL_ARRAY_BUFFER, corner_buffer_, corners_);
  glActiveTexture(GL_TEXTURE0);
  FillTextureBuffer(projection_buffer_, projection_texture_, GL_RGBA32F, projections_);
  FillTextureBuffer(place_buffer_, place_texture_, GL_R32UI, places_);
}

void PlanLines::Add(const Eigen::Vector2i& size_px, const Eigen::Vector2f& a, const Eigen::Vector2f& b,
                    const Eigen::Vector4f& rgba) {
  for (const Eigen::Vector2f* end : {&a, &b}) {
    const Eigen::Vector2f clip = ClipFromPixel(*end, size_px);
    lines_.push_back({clip.x(), clip.y(), rgba.x(), rgba.y(), rgba.z(), rgba.w()});
  }
}

void PlanLines::AddCrosses(const Eigen::Vector2i& size_px, const std::vector<Eigen::Vector2f>& at) {
  for (const Eigen::Vector2f& x : at)
    for (const Eigen::Vector2f& d : {Eigen::Vector2f(kCrossPx, kCrossPx), Eigen::Vector2f(kCrossPx, -kCrossPx)})
      Add(size_px, x - d, x + d, kEpipoleColor);
}

void PlanLines::Set(const SparsePlan& plan, const Eigen::Vector2i& size_px) {
  lines_.clear();
  // Each once, though triangles share edges: they are see-through.
  std::set<std::array<float, 4>> drawn;
  for (const SparseTriangle& triangle : plan.triangles)
    for (std::size_t v = 0; v < 3; ++v) {
      Eigen::Vector2f a = plan.x_px[static_cast<std::size_t>(triangle.vertex[v])],
                      b = plan.x_px[static_cast<std::size_t>(triangle.vertex[(v + 1) % 3])];
      if (std::pair(b.x(), b.y()) < std::pair(a.x(), a.y())) std::swap(a, b);
      if (drawn.insert({a.x(), a.y(), b.x(), b.y()}).second) Add(size_px, a, b, kEdgeColor);
    }
  AddCrosses(size_px, plan.epipoles_px);
  Upload();
}

void PlanLines::Set(const CandidatePlan& plan, const Eigen::Vector2i& size_px) {
  lines_.clear();
  const Eigen::Vector2f size = size_px.cast<float>();
  // Not on the picture's border, where half of a line is outside.
  for (int i = 1; i < plan.cell_columns; ++i) {
    const auto x = static_cast<float>(i * plan.cell_width_px);
    Add(size_px, {x, 0}, {x, size.y()}, kEdgeColor);
  }
  for (int i = 1; i < plan.cell_rows; ++i) {
    const auto y = static_cast<float>(i * plan.cell_height_px);
    Add(size_px, {0, y}, {size.x(), y}, kEdgeColor);
  }
  AddCrosses(size_px, plan.geometry.epipoles_px);
  Upload();
}

void PlanLines::Upload() {
  if (!vertex_array_) {
    vertex_array_ = GlVertexArray::Make();
    buffer_ = GlBuffer::Make();
    glBindVertexArray(vertex_array_.id());
    glBindBuffer(GL_ARRAY_BUFFER, buffer_.id());
    glEnableVertexAttribArray(0);
    glEnableVertexAttribArray(1);
    glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, sizeof(End), nullptr);
    glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, sizeof(End), reinterpret_cast<const void*>(offsetof(End, r)));
    glBindVertexArray(0);
  }
  FillBuffer(GL_ARRAY_BUFFER, buffer_, lines_);
}

void PlanLines::Draw() {
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glBindVertexArray(vertex_array_.id());
  glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(lines_.size()));
  glBindVertexArray(0);
  glDisable(GL_BLEND);
}

}  // namespace lumi
