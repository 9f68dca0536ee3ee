// What GlLumigraph keeps on the graphics processor: the proxy and what photos see of it, photos, cameras, tables.
#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "render/gl/gl_lumigraph.h"
#include "render/gl/gl_lumigraph_parts.h"
#include "render/radiance/correlation.h"
#include "render/radiance/measures/evaluate.h"
#include "render/world/visibility_maps.h"
#include "scene/program/error.h"

namespace lumi {

void GlLumigraph::SetProxy(const Mesh& proxy) {
  if (const auto problem = Validate(proxy)) throw std::invalid_argument("SetProxy: " + *problem);
  const auto tracer = std::make_shared<const ProxyTracer>(proxy, sources_.normalized_from_world);
  SetProxy(proxy, std::make_shared<const VisibilityMaps>(ProxyVisibility(sources_, proxy, *tracer)), tracer);
}

void GlLumigraph::SetCameras(const Sources& cameras) {
  if (cameras.views.size() != sources_.views.size())
    throw std::invalid_argument("SetCameras: as many cameras as photos are wanted");
  sources_ = cameras;
  UploadFields();
}

void GlLumigraph::UploadFields() {
  std::vector<float> cells;
  for (std::size_t i = 0; i < sources_.fields->size(); ++i) {
    const PhotoField& field = (*sources_.fields)[i];
    field_places_[i] = {static_cast<int>(cells.size()), field.value.empty() ? 0 : field.columns, field.rows};
    cells.insert(cells.end(), field.value.begin(), field.value.end());
  }
  glActiveTexture(GL_TEXTURE0 + kFieldUnit);
  if (!cells.empty()) FillTextureBuffer(field_buffer_, field_texture_, GL_R32F, cells);
}

void GlLumigraph::SetProxy(const Mesh& proxy, std::shared_ptr<const VisibilityMaps> maps,
                           std::shared_ptr<const ProxyTracer> tracer) {
  if (const auto problem = Validate(proxy)) throw std::invalid_argument("SetProxy: " + *problem);
  proxy_ = proxy;
  sparse_proxy_.reset();
  tracer_ = std::move(tracer);
  std::vector<float> x;
  x.reserve(3 * proxy.vertices.size());
  for (const Eigen::Vector3d& v : proxy.vertices) {
    const Eigen::Vector3f n = (sources_.normalized_from_world * v).cast<float>();
    x.insert(x.end(), n.data(), n.data() + 3);
  }
  std::vector<float> normals;
  normals.reserve(4 * proxy.faces.size() + 4);
  for (const auto& f : proxy.faces) {
    const auto at = [&](std::size_t i) -> const Eigen::Vector3d& {
      return proxy.vertices[static_cast<std::size_t>(f[i])];
    };
    const Eigen::Vector3d in_world = (at(1) - at(0)).cross(at(2) - at(0));
    const Eigen::Vector3f n = (sources_.normalized_from_world.rotation * in_world).normalized().cast<float>();
    normals.insert(normals.end(), {n.x(), n.y(), n.z(), 0.0F});
  }
  FillBuffer(GL_SHADER_STORAGE_BUFFER, normals_, normals);
  mesh_array_ = GlVertexArray::Make();
  glBindVertexArray(mesh_array_.id());
  FillBuffer(GL_ARRAY_BUFFER, vertices_, x);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  FillBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_, proxy.faces);
  glBindVertexArray(0);
  index_count_ = static_cast<int>(3 * proxy.faces.size());
  UploadVisibility(std::move(maps));
  CheckGl("uploading the proxy");
}

void GlLumigraph::UploadVisibility(std::shared_ptr<const VisibilityMaps> maps) {
  visibility_ = std::make_shared<const VisibilityMaps>();
  if (maps->empty()) return;
  const auto count = static_cast<int>(sources_.views.size());
  const std::size_t texels = maps->Map(0).size(), all = texels * static_cast<std::size_t>(count);
  GLint limit = 65536;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &limit);
  if (all > static_cast<std::size_t>(limit))
    throw MachineError("this driver's texture buffers hold " + std::to_string(limit) +
                           " values; what the photos see of the proxy takes " + std::to_string(all),
                       "use --backend cpu");
  FillTextureBuffer(visibility_buffer_, visibility_texture_, GL_R32F, nullptr, all * sizeof(float));
  for (int j = 0; j < count; ++j)
    glBufferSubData(GL_TEXTURE_BUFFER, static_cast<GLintptr>(static_cast<std::size_t>(j) * texels * sizeof(float)),
                    static_cast<GLsizeiptr>(texels * sizeof(float)), maps->Map(j).data());
  visibility_ = std::move(maps);
}

void GlLumigraph::Upload(ViewId view, const Photo& photo) {
  const auto j = static_cast<std::size_t>(view.value);
  const bool again = photos_.places().at(j).loaded && !photos_.places()[j].small_copy;
  photos_.Upload(j, photo);
  if (!again) ++loaded_;
}

void GlLumigraph::Drop(ViewId view) {
  const auto j = static_cast<std::size_t>(view.value);
  if (!photos_.places().at(j).loaded || photos_.places()[j].small_copy) return;
  photos_.Drop(j);
  --loaded_;
}

void GlLumigraph::WantPhotos(std::span<const WantedPhoto> wanted) {
  std::vector<PhotoSlots::Wish> wishes;
  for (const WantedPhoto& w : wanted) {
    const bool copied = photos_.places()[static_cast<std::size_t>(w.photo)].loaded;
    if (copied && small_halvings_ >= 0 && w.halvings >= small_halvings_) continue;
    wishes.push_back({w.photo, std::min(w.halvings, kSlotSizes - 1)});
  }
  slots_.value().Want(wishes);
}

void GlLumigraph::UploadSmallCopy(ViewId view, const Photo& copy) {
  photos_.UploadSmallCopy(static_cast<std::size_t>(view.value), copy);
}

void GlLumigraph::Offer(ViewId view, const Photo& photo, int halvings) {
  const PhotoSlots::Placed placed = slots_.value().Place(view.value, halvings);
  if (!placed.placed) return;
  if (placed.dropped >= 0) Drop({placed.dropped});
  if (photo.level0_shift >= halvings) return Upload(view, photo);
  Upload(view, HalvedTo(photo, halvings));
}

void GlLumigraph::GiveUp(ViewId view) { slots_.value().GiveUp(view.value); }

void GlLumigraph::DropPhotos() {
  for (std::size_t j = 0; j < photos_.places().size(); ++j) {
    const ViewId view{static_cast<std::int32_t>(j)};
    Drop(view);
    if (slots_) slots_->Drop(view.value);
  }
}

void GlLumigraph::SetSourceColors(const std::vector<Eigen::Vector3f>& colors) {
  if (colors.size() != sources_.views.size())
    throw std::invalid_argument("SetSourceColors: one colour a view is wanted");
  colors_ = colors;
  std::vector<float> rgba;
  for (const auto& c : colors_) rgba.insert(rgba.end(), {c.x(), c.y(), c.z(), 1.0F});
  FillTextureBuffer(color_buffer_, color_texture_, GL_RGBA32F, rgba);
}

void PackCameras(const ViewSetup& setup, int rows_a_camera, std::vector<float>& rows, std::vector<int>& views) {
  const RelativeSources& s = setup.sources;
  views.clear();
  for (int j = 0; j < s.count; ++j)
    if (s.enabled[static_cast<std::size_t>(j)] > 0) views.push_back(j);
  const auto squared_distance = [&](int j) {
    const auto i = static_cast<std::size_t>(j);
    return s.dx[i] * s.dx[i] + s.dy[i] * s.dy[i] + s.dz[i] * s.dz[i];
  };
  // Without the angle ties are common, and go to the first.
  if (setup.settings.alpha > 0)
    std::stable_sort(views.begin(), views.end(),
                     [&](int a, int b) { return squared_distance(a) < squared_distance(b); });
  const std::vector<float> terms = PhotoTerms(s, setup.settings);
  rows.clear();
  for (const int j : views) {
    const auto i = static_cast<std::size_t>(j);
    rows.insert(rows.end(), {s.dx[i], s.dy[i], s.dz[i], s.width_px[i]});
    rows.insert(rows.end(), {s.m[0][i], s.m[1][i], s.m[2][i], s.height_px[i]});
    rows.insert(rows.end(), {s.m[3][i], s.m[4][i], s.m[5][i], s.feather_px[i]});
    rows.insert(rows.end(), {s.m[6][i], s.m[7][i], s.m[8][i], s.focal_px[i]});
    if (rows_a_camera > 4) rows.insert(rows.end(), {terms[i], s.gain[i], 0.0F, 0.0F});
  }
}

void GlLumigraph::UploadCameras(const ViewSetup& setup, const BlendVariant& variant) {
  if (variant.correlation == Correlation::kFallingLeaves) UploadLeaves(setup.settings);
  std::vector<float> rows;
  PackCameras(setup, CameraRows(variant), rows, packed_views_);
  std::vector<std::uint32_t> places;
  places.reserve(4 * packed_views_.size());
  for (const int j : packed_views_) {
    const PhotoPlace& p = photos_.places()[static_cast<std::size_t>(j)];
    const auto u = [](int value) { return static_cast<std::uint32_t>(value); };
    places.insert(places.end(), {u(p.size_px.x()) | u(p.size_px.y()) << 16,
                                 u(p.group) | u(p.top_level) << 8 | u(p.shift) << 16, u(p.layer), u(j)});
  }
  glActiveTexture(GL_TEXTURE0 + kPlaceUnit);
  FillTextureBuffer(place_buffer_, place_texture_, GL_RGBA32UI, places);
  if (variant.cameras_in_uniforms) {
    rows.resize(static_cast<std::size_t>(variant.camera_capacity * CameraRows(variant) * kFloatsPerRow));
    FillBuffer(GL_UNIFORM_BUFFER, camera_block_, rows);
  } else {
    FillTextureBuffer(camera_buffer_, camera_texture_, GL_RGBA32F, rows);
  }
}

void GlLumigraph::UploadLeaves(const RadianceSettings& s) {
  if (leaf_buffer_ && leaf_radii_ == std::pair(s.r_min_rad, s.r_max_rad)) return;
  leaf_radii_ = {s.r_min_rad, s.r_max_rad};
  // From so small an angle that P_same is 1, to where it is 0.
  const FallingLeaves leaves(s.r_min_rad, s.r_max_rad);
  const double from = std::log2(1e-6 * std::max(s.r_min_rad, 1e-6 * s.r_max_rad)), to = std::log2(2 * s.r_max_rad);
  leaf_place_ = {kLeafSteps / (to - from), -from * kLeafSteps / (to - from)};
  std::vector<float> table;
  for (int i = 0; i <= kLeafSteps; ++i)
    table.push_back(static_cast<float>(std::pow(leaves.PSame(std::exp2(from + (to - from) * i / kLeafSteps)), 0.4)));
  table.back() = 0;
  FillBuffer(GL_SHADER_STORAGE_BUFFER, leaf_buffer_, table);
}

void GlLumigraph::ReserveLists(std::size_t words) {
  glActiveTexture(GL_TEXTURE0 + kListUnit);
  FillTextureBuffer(list_buffer_, list_texture_, GL_R32UI, nullptr, words * sizeof(std::uint32_t));
  list_words_ = words;
}

}  // namespace lumi
