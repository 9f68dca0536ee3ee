#include "render/gl/sparse_drawing.h"

#include <epoxy/gl.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <string>

#include "scene/program/error.h"

namespace lumi {
namespace {

// A plane that passes the desired centre within this part of its distance is seen edge-on: it covers no pixel's centre,
// and its inverse depth has no digits.
constexpr double kEdgeOn = 1e-9;
// In front of what they are drawn over, relative depth.
constexpr float kLineLift = 1e-4F;
const Eigen::Vector3f kEdgeColor(1.0F, 0.85F, 0.1F);
const Eigen::Vector3f kEpipoleColor(1.0F, 0.1F, 0.9F);
constexpr float kCrossPx = 4;

std::uint32_t Unorm16(float v) { return static_cast<std::uint32_t>(std::lround(std::clamp(v, 0.0F, 1.0F) * 65535.0F)); }

// Inverse depth along the optical axis as a linear function of (x_px, y_px, 1); false for a plane seen edge-on.
bool InverseDepth(const Eigen::Vector3d& normal, const Eigen::Vector3d& on_plane, const Eigen::Matrix3d& ray_from_pixel, Eigen::Vector3d& out) {
  const double away = normal.dot(on_plane), size = normal.norm() * on_plane.norm();
  if (!(std::abs(away) > kEdgeOn * size)) return false;
  out = ray_from_pixel.transpose() * normal / away;
  return out.allFinite();
}

void FillBuffer(GLenum target, GlBuffer& buffer, const void* data, std::size_t bytes) {
  if (!buffer) buffer = GlBuffer::Make();
  glBindBuffer(target, buffer.id());
  // A new store each time: the one before may still be read.
  glBufferData(target, static_cast<GLsizeiptr>(std::max<std::size_t>(bytes, 16)), nullptr, GL_STREAM_DRAW);
  if (bytes > 0) glBufferSubData(target, 0, static_cast<GLsizeiptr>(bytes), data);
}

Eigen::Vector2f ClipFromPixel(const Eigen::Vector2f& x_px, const Eigen::Vector2i& size_px) {
  return (2 * x_px.array() / size_px.cast<float>().array() - 1).matrix();
}

}  // namespace

void SparseDrawing::Upload(const SparsePlan& plan, const ViewSetup& setup, const NormalizedProxy& proxy, std::span<const int> views,
                           const PhotoTextures& photos, const SparseVariant& base) {
  const RelativeSources& s = setup.sources;
  const Eigen::Vector3f axis = setup.desired.P.row(2).head<3>().transpose().cast<float>();
  // What a camera has in all triangles: the homography of the plane at infinity, and the epipole.
  struct Projection {
    int packed = -1;
    Eigen::Matrix3d from_pixel;
    Eigen::Vector3d epipole;
    float focal_ratio = 0;
    std::uint32_t place = 0;
  };
  std::vector<Projection> projections(static_cast<std::size_t>(s.count));
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto j = static_cast<std::size_t>(views[i]);
    Projection& p = projections[j];
    p.packed = static_cast<int>(i);
    Eigen::Matrix3d M;
    for (int r = 0; r < 9; ++r) M(r / 3, r % 3) = static_cast<double>(s.m[r][j]);
    M.row(0) /= static_cast<double>(s.width_px[j]);
    M.row(1) /= static_cast<double>(s.height_px[j]);
    p.from_pixel = M * setup.ray_from_pixel;
    p.epipole = M * Eigen::Vector3d(static_cast<double>(s.dx[j]), static_cast<double>(s.dy[j]), static_cast<double>(s.dz[j]));
    const PhotoPlace& place = photos.places()[j];
    // The stretch from which the pyramid is read.
    p.focal_ratio = s.focal_px[j] / setup.focal_px / static_cast<float>(1 << std::clamp(place.shift, 0, 30));
    p.place = static_cast<std::uint32_t>(place.layer) | static_cast<std::uint32_t>(place.group) << 16;
  }

  // By what they need: a bit for photos that end, a bit for pyramids.
  constexpr std::size_t kKinds = 4;
  std::vector<std::uint8_t> kind_of(plan.triangles.size(), kKinds);
  std::vector<Corner> drawn(plan.triangles.size());
  std::array<std::size_t, kKinds> count{};
  records_.clear();
  for (std::size_t i = 0; i < plan.triangles.size(); ++i) {
    const SparseTriangle& triangle = plan.triangles[i];
    std::array<Eigen::Vector3d, 3> x;
    for (std::size_t v = 0; v < 3; ++v) x[v] = plan.offset[static_cast<std::size_t>(triangle.vertex[v])].cast<double>();
    Eigen::Vector3d inverse_depth;
    if (triangle.face >= 0 && static_cast<std::size_t>(triangle.face) < proxy.faces.size()) {
      // The face's own plane: a sliver's corners do not tell it.
      const auto& face = proxy.faces[static_cast<std::size_t>(triangle.face)];
      const Eigen::Vector3d& a = proxy.vertices[static_cast<std::size_t>(face[0])];
      const Eigen::Vector3d normal = (proxy.vertices[static_cast<std::size_t>(face[1])] - a).cross(proxy.vertices[static_cast<std::size_t>(face[2])] - a);
      if (!InverseDepth(normal, a - setup.desired.centre, setup.ray_from_pixel, inverse_depth)) continue;
    } else if (!InverseDepth((x[1] - x[0]).cross(x[2] - x[0]), x[0], setup.ray_from_pixel, inverse_depth)) {
      continue;
    }
    Corner& c = drawn[i];
    for (int r = 0; r < 3; ++r) c.plane[r] = static_cast<float>(inverse_depth[r]);
    c.first = static_cast<std::uint32_t>(records_.size());
    bool oversampled = false;
    for (std::int32_t n = triangle.first; n < triangle.first + triangle.count; ++n) {
      const auto e = static_cast<std::size_t>(n);
      const Projection& p = projections[static_cast<std::size_t>(plan.camera[e])];
      if (p.packed < 0) continue;
      const std::array<float, 3>& w = plan.weight[e];
      Record& record = records_.emplace_back();
      const Eigen::Matrix3d H = p.from_pixel - p.epipole * inverse_depth.transpose();
      const Eigen::Matrix3f h = H.cast<float>();
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
          record[static_cast<std::size_t>(4 * row + column)] = std::bit_cast<std::uint32_t>(h(row, column));
      record[3] = Unorm16(w[0]) | Unorm16(w[1]) << 16;
      record[7] = Unorm16(w[2]) | static_cast<std::uint32_t>(p.packed) << 16;
      record[11] = p.place;
      for (std::size_t v = 0; v < 3; ++v) {
        const Eigen::Vector2f& px = plan.x_px[static_cast<std::size_t>(triangle.vertex[v])];
        oversampled |= p.focal_ratio > h(2, 0) * px.x() + h(2, 1) * px.y() + h(2, 2);
      }
    }
    c.last = static_cast<std::uint32_t>(records_.size());
    const std::size_t kind = (triangle.inside ? 0U : 1U) + (base.blend.prefilter && oversampled ? 2U : 0U);
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
    if ((kind & 1) == 0) batch.variant.ends = PhotoEnds::kNever;
    batch.variant.blend.prefilter = (kind & 2) != 0;
    batches_.push_back(batch);
    total += 3 * count[kind];
  }
  corners_.resize(total);
  for (std::size_t i = 0; i < plan.triangles.size(); ++i) {
    if (kind_of[i] == kKinds) continue;
    for (std::size_t v = 0; v < 3; ++v) {
      const auto vertex = static_cast<std::size_t>(plan.triangles[i].vertex[v]);
      Corner& c = corners_[next[kind_of[i]]++] = drawn[i];
      const Eigen::Vector2f clip = ClipFromPixel(plan.x_px[vertex], setup.desired.size_px);
      c.x = clip.x();
      c.y = clip.y();
      c.z = std::min(1.0F, kNearDepth / std::max(axis.dot(plan.offset[vertex]), kNearDepth));
      c.alpha = plan.alpha[vertex];
    }
  }

  GLint limit = 65536;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &limit);
  if (3 * records_.size() > static_cast<std::size_t>(limit))
    throw MachineError("this driver's texture buffers hold " + std::to_string(limit / 3) + " photos of triangles; the plan has " +
                           std::to_string(records_.size()),
                       "use a smaller --grid or --k, or --backend cpu");
  if (!vertex_array_) {
    vertex_array_ = GlVertexArray::Make();
    corner_buffer_ = GlBuffer::Make();
    glBindVertexArray(vertex_array_.id());
    glBindBuffer(GL_ARRAY_BUFFER, corner_buffer_.id());
    const auto at = [](std::size_t offset) { return reinterpret_cast<const void*>(offset); };
    for (GLuint i = 0; i < 3; ++i) glEnableVertexAttribArray(i);
    glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, sizeof(Corner), at(offsetof(Corner, x)));
    glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(Corner), at(offsetof(Corner, plane)));
    glVertexAttribIPointer(2, 2, GL_UNSIGNED_INT, sizeof(Corner), at(offsetof(Corner, first)));
    glBindVertexArray(0);
  }
  FillBuffer(GL_ARRAY_BUFFER, corner_buffer_, corners_.data(), corners_.size() * sizeof(Corner));
  FillBuffer(GL_TEXTURE_BUFFER, record_buffer_, records_.data(), records_.size() * sizeof(Record));
  if (!record_texture_) {
    record_texture_ = GlTexture::Make();
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_BUFFER, record_texture_.id());
    glTexBuffer(GL_TEXTURE_BUFFER, GL_RGBA32UI, record_buffer_.id());
  }
}

void PlanLines::Add(const Eigen::Vector2i& size_px, const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& rgb) {
  for (const Eigen::Vector3f* end : {&a, &b}) {
    const Eigen::Vector2f clip = ClipFromPixel(end->head<2>(), size_px);
    lines_.push_back({clip.x(), clip.y(), end->z(), rgb.x(), rgb.y(), rgb.z()});
  }
}

void PlanLines::Set(const SparsePlan& plan, const ViewSetup& setup) {
  lines_.clear();
  const Eigen::Vector3f axis = setup.desired.P.row(2).head<3>().transpose().cast<float>();
  const Eigen::Vector2i size = setup.desired.size_px;
  for (const SparseTriangle& triangle : plan.triangles)
    for (std::size_t v = 0; v < 3; ++v) {
      std::array<Eigen::Vector3f, 2> ends;
      for (std::size_t e = 0; e < 2; ++e) {
        const auto vertex = static_cast<std::size_t>(triangle.vertex[(v + e) % 3]);
        const float z = kNearDepth / std::max(axis.dot(plan.offset[vertex]), kNearDepth) * (1 + kLineLift);
        ends[e] << plan.x_px[vertex], std::min(z, 1.0F);
      }
      Add(size, ends[0], ends[1], kEdgeColor);
    }
  for (const Eigen::Vector2f& x : plan.epipoles_px)
    for (const auto& [dx, dy] : {std::pair{kCrossPx, 0.0F}, {0.0F, kCrossPx}})
      Add(size, {x.x() - dx, x.y() - dy, 1}, {x.x() + dx, x.y() + dy, 1}, kEpipoleColor);
  Upload();
}

void PlanLines::Set(const CandidatePlan& plan, const Eigen::Vector2i& size_px) {
  lines_.clear();
  const Eigen::Vector2f size = size_px.cast<float>();
  // Not on the picture's border, where half of a line is outside.
  for (int i = 1; i < plan.cell_columns; ++i) {
    const auto x = static_cast<float>(i * plan.cell_width_px);
    Add(size_px, {x, 0, 1}, {x, size.y(), 1}, kEdgeColor);
  }
  for (int i = 1; i < plan.cell_rows; ++i) {
    const auto y = static_cast<float>(i * plan.cell_height_px);
    Add(size_px, {0, y, 1}, {size.x(), y, 1}, kEdgeColor);
  }
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
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(End), nullptr);
    glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(End), reinterpret_cast<const void*>(offsetof(End, r)));
    glBindVertexArray(0);
  }
  FillBuffer(GL_ARRAY_BUFFER, buffer_, lines_.data(), lines_.size() * sizeof(End));
}

void PlanLines::Draw() {
  glBindVertexArray(vertex_array_.id());
  glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(lines_.size()));
  glBindVertexArray(0);
}

}  // namespace lumi
