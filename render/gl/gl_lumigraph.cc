#include "render/gl/gl_lumigraph.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "render/radiance/sources.h"
#include "render/visibility_maps.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

enum Unit { kDepthUnit, kPlaceUnit, kColorUnit, kCameraUnit, kVisibilityUnit, kFirstPhotoUnit };
static_assert(kFirstPhotoUnit == kReservedTextureUnits);

constexpr int kFloatsPerCamera = 16;
constexpr int kMaxUniformCameras = 1024;
// 128 MB of lists: beyond it (a thousand cameras and a picture of 32 megapixels) pixels look at all cameras.
constexpr std::size_t kMaxListWords = std::size_t(1) << 25;

void MakeTexture(GlTexture& texture, GLenum format, const Eigen::Vector2i& size) {
  texture = GlTexture::Make();
  glBindTexture(GL_TEXTURE_2D, texture.id());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, size.x(), size.y());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

void RequireComplete() {
  const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE) throw std::logic_error("an OpenGL framebuffer is incomplete");
}

template <typename T>
void FillTextureBuffer(GlBuffer& buffer, GlTexture& texture, GLenum format, const std::vector<T>& data) {
  if (!buffer) buffer = GlBuffer::Make();
  glBindBuffer(GL_TEXTURE_BUFFER, buffer.id());
  glBufferData(GL_TEXTURE_BUFFER, static_cast<GLsizeiptr>(std::max<std::size_t>(data.size(), 4) * sizeof(T)), nullptr,
               GL_STREAM_DRAW);
  glBufferSubData(GL_TEXTURE_BUFFER, 0, static_cast<GLsizeiptr>(data.size() * sizeof(T)), data.data());
  if (!texture) {
    texture = GlTexture::Make();
    glBindTexture(GL_TEXTURE_BUFFER, texture.id());
    glTexBuffer(GL_TEXTURE_BUFFER, format, buffer.id());
  }
}

}  // namespace

void GlTarget::Reserve(const Eigen::Vector2i& size_px) {
  if ((size_px.array() <= capacity_px_.array()).all()) return;
  GLint max_size = 16384;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_size);
  if (size_px.maxCoeff() > max_size)
    throw MachineError("a picture of " + std::to_string(size_px.x()) + "x" + std::to_string(size_px.y()) +
                           " is larger than this driver's textures (" + std::to_string(max_size) + ")",
                       "use --backend cpu");
  capacity_px_ = capacity_px_.cwiseMax(size_px).eval();
  glActiveTexture(GL_TEXTURE0);
  MakeTexture(depth_, GL_R32F, capacity_px_);
  MakeTexture(depth_test_, GL_DEPTH_COMPONENT32F, capacity_px_);
  MakeTexture(color_, GL_RGBA32F, capacity_px_);
  depth_framebuffer_ = GlFramebuffer::Make();
  glBindFramebuffer(GL_FRAMEBUFFER, depth_framebuffer_.id());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, depth_.id(), 0);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_test_.id(), 0);
  RequireComplete();
  color_framebuffer_ = GlFramebuffer::Make();
  glBindFramebuffer(GL_FRAMEBUFFER, color_framebuffer_.id());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color_.id(), 0);
  RequireComplete();
  CheckGl("making room for a picture");
}

GlLumigraph::GlLumigraph(const Scene& scene, const std::vector<Eigen::Vector2i>& photo_sizes_px)
    : sources_((RequireGl43(), MakeSources(scene))), photos_(photo_sizes_px) {
  if (photo_sizes_px.size() != scene.views.size())
    throw std::invalid_argument("GlLumigraph: one photo size a view is wanted");
  GLint block_bytes = 16384;
  glGetIntegerv(GL_MAX_UNIFORM_BLOCK_SIZE, &block_bytes);
  uniform_capacity_ = std::min<int>(kMaxUniformCameras, block_bytes / (kFloatsPerCamera * static_cast<int>(sizeof(float))));
  depth_program_ = GlProgram("depth", DepthVertexShader(), DepthFragmentShader());
  empty_array_ = GlVertexArray::Make();
  std::vector<Eigen::Vector3f> colors;
  for (std::size_t i = 0; i < scene.views.size(); ++i) colors.push_back(SourceColor(static_cast<int>(i)));
  SetSourceColors(colors);
  CheckGl("preparing to draw");
}

void GlLumigraph::SetProxy(const Mesh& proxy) {
  if (const auto problem = Validate(proxy)) throw std::invalid_argument("SetProxy: " + *problem);
  SetProxy(proxy, ProxyVisibility(sources_, proxy));
}

void GlLumigraph::SetGains(const std::vector<double>& gains) {
  if (gains.size() != sources_.views.size()) throw std::invalid_argument("SetGains: one gain a view is wanted");
  for (std::size_t j = 0; j < gains.size(); ++j) sources_.views[j].gain = gains[j];
}

void GlLumigraph::SetProxy(const Mesh& proxy, VisibilityMaps maps) {
  if (const auto problem = Validate(proxy)) throw std::invalid_argument("SetProxy: " + *problem);
  std::vector<float> x;
  x.reserve(3 * proxy.vertices.size());
  for (const Eigen::Vector3d& v : proxy.vertices) {
    const Eigen::Vector3f n = (sources_.normalized_from_world * v).cast<float>();
    x.insert(x.end(), n.data(), n.data() + 3);
  }
  mesh_array_ = GlVertexArray::Make();
  vertices_ = GlBuffer::Make();
  indices_ = GlBuffer::Make();
  glBindVertexArray(mesh_array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.id());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(x.size() * sizeof(float)), x.data(), GL_STATIC_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.id());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(proxy.faces.size() * sizeof(proxy.faces[0])),
               proxy.faces.data(), GL_STATIC_DRAW);
  glBindVertexArray(0);
  index_count_ = static_cast<int>(3 * proxy.faces.size());
  UploadVisibility(std::move(maps));
  CheckGl("uploading the proxy");
}

void GlLumigraph::UploadVisibility(VisibilityMaps maps) {
  visibility_size_.setZero();
  if (maps.empty()) return;
  const auto count = static_cast<int>(sources_.views.size());
  std::vector<float> texels;
  for (int j = 0; j < count; ++j) texels.insert(texels.end(), maps.Map(j).begin(), maps.Map(j).end());
  GLint limit = 65536;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &limit);
  if (texels.size() > static_cast<std::size_t>(limit))
    throw MachineError("this driver's texture buffers hold " + std::to_string(limit) + " values; what the photos see of the proxy takes " +
                           std::to_string(texels.size()),
                       "use --backend cpu");
  FillTextureBuffer(visibility_buffer_, visibility_texture_, GL_R32F, texels);
  visibility_size_ = {maps.width(), maps.height()};
}

void GlLumigraph::Upload(ViewId view, const Photo& photo) {
  const auto j = static_cast<std::size_t>(view.value);
  const bool again = photos_.places().at(j).loaded;
  photos_.Upload(j, photo);
  if (!again) ++loaded_;
}

void GlLumigraph::SetSourceColors(const std::vector<Eigen::Vector3f>& colors) {
  if (colors.size() != sources_.views.size()) throw std::invalid_argument("SetSourceColors: one colour a view is wanted");
  colors_ = colors;
  std::vector<float> rgba;
  for (const auto& c : colors_) rgba.insert(rgba.end(), {c.x(), c.y(), c.z(), 1.0F});
  FillTextureBuffer(color_buffer_, color_texture_, GL_RGBA32F, rgba);
}

// What does not change from picture to picture.
void GlLumigraph::Prepare(const GlProgram& program, const BlendVariant& variant) const {
  program.Use();
  glUniform1i(program.Uniform("depth_map"), kDepthUnit);
  glUniform1i(program.Uniform("places"), kPlaceUnit);
  glUniform1i(program.Uniform("source_colors"), kColorUnit);
  glUniform1i(program.Uniform("visibility_maps"), kVisibilityUnit);
  if (variant.cameras_in_uniforms) {
    const GLuint block = glGetUniformBlockIndex(program.id(), "Cameras");
    if (block != GL_INVALID_INDEX) glUniformBlockBinding(program.id(), block, 0);
  } else {
    glUniform1i(program.Uniform("cameras"), kCameraUnit);
  }
  std::vector<GLint> units, sizes;
  for (int g = 0; g < photos_.group_count(); ++g) {
    units.push_back(kFirstPhotoUnit + g);
    sizes.push_back(photos_.GroupSize(g).x());
    sizes.push_back(photos_.GroupSize(g).y());
  }
  glUniform1iv(program.Uniform("photos"), static_cast<GLsizei>(units.size()), units.data());
  glUniform2iv(program.Uniform("group_size"), static_cast<GLsizei>(units.size()), sizes.data());
  CheckGl("compiling the shaders");
}

const GlLumigraph::Programs& GlLumigraph::ProgramsFor(const BlendVariant& variant) {
  auto found = programs_.find(variant);
  if (found == programs_.end()) {
    Programs programs{GlProgram("blend", FullScreenVertexShader(), BlendFragmentShader(variant)),
                      GlProgram("cull", CullComputeShader(variant))};
    Prepare(programs.blend, variant);
    Prepare(programs.cull, variant);
    found = programs_.emplace(variant, std::move(programs)).first;
  }
  return found->second;
}

void PackCameras(const RelativeSources& s, std::vector<float>& rows, std::vector<int>& views) {
  views.clear();
  for (int j = 0; j < s.count; ++j)
    if (s.enabled[static_cast<std::size_t>(j)] > 0) views.push_back(j);
  const auto squared_distance = [&](int j) {
    const auto i = static_cast<std::size_t>(j);
    return s.dx[i] * s.dx[i] + s.dy[i] * s.dy[i] + s.dz[i] * s.dz[i];
  };
  std::stable_sort(views.begin(), views.end(), [&](int a, int b) { return squared_distance(a) < squared_distance(b); });
  rows.clear();
  for (const int j : views) {
    const auto i = static_cast<std::size_t>(j);
    rows.insert(rows.end(), {s.dx[i], s.dy[i], s.dz[i], s.width_px[i]});
    rows.insert(rows.end(), {s.m[0][i], s.m[1][i], s.m[2][i], s.height_px[i]});
    rows.insert(rows.end(), {s.m[3][i], s.m[4][i], s.m[5][i], s.feather_px[i]});
    rows.insert(rows.end(), {s.m[6][i], s.m[7][i], s.m[8][i], s.focal_px[i]});
  }
}

void GlLumigraph::Begin(const RenderRequest& request, GlTarget& target) {
  size_px_ = request.view.size_px;
  if (size_px_.minCoeff() <= 0) throw std::invalid_argument("GlLumigraph: the view has no size");
  std::vector<bool> use = request.use;
  if (request.show == Show::kColor) {
    if (use.empty()) use.assign(sources_.views.size(), true);
    for (std::size_t j = 0; j < use.size() && j < photos_.places().size(); ++j)
      use[j] = use[j] && photos_.places()[j].loaded;
  }
  const ViewSetup setup = MakeViewSetup(sources_, request.view, request.settings, use);
  target.Reserve(size_px_);

  // Depth.
  glBindFramebuffer(GL_FRAMEBUFFER, target.depth_framebuffer());
  glViewport(0, 0, size_px_.x(), size_px_.y());
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glDisable(GL_SCISSOR_TEST);
  glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
  glDepthMask(GL_TRUE);
  const float nothing[4] = {0, 0, 0, 0};
  glClearBufferfv(GL_COLOR, 0, nothing);
  glClearBufferfv(GL_DEPTH, 0, nothing);
  if (index_count_ > 0) {
    // Pixels to clip units; the picture's first row is GL's first.
    Eigen::Matrix3d clip_from_pixel = Eigen::Matrix3d::Identity();
    clip_from_pixel(0, 0) = 2.0 / size_px_.x();
    clip_from_pixel(1, 1) = 2.0 / size_px_.y();
    clip_from_pixel(0, 2) = clip_from_pixel(1, 2) = -1.0;
    const Eigen::Matrix3f clip = (clip_from_pixel * setup.desired.P.leftCols<3>()).cast<float>();
    const Eigen::Vector3f centre = setup.desired.centre.cast<float>();
    depth_program_.Use();
    glUniform3fv(depth_program_.Uniform("centre"), 1, centre.data());
    glUniformMatrix3fv(depth_program_.Uniform("clip_from_offset"), 1, GL_FALSE, clip.data());
    glBindVertexArray(mesh_array_.id());
    glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
  }
  glDisable(GL_DEPTH_TEST);

  // Cameras.
  std::vector<float> rows;
  std::vector<int> views;
  PackCameras(setup.sources, rows, views);
  const int count = static_cast<int>(views.size());
  std::vector<std::uint32_t> places;
  places.reserve(4 * views.size());
  for (const int j : views) {
    const PhotoPlace& p = photos_.places()[static_cast<std::size_t>(j)];
    const auto u = [](int value) { return static_cast<std::uint32_t>(value); };
    places.insert(places.end(), {u(p.size_px.x()) | u(p.size_px.y()) << 16,
                                 u(p.group) | u(p.top_level) << 8 | u(p.shift) << 16, u(p.layer), u(j)});
  }
  BlendVariant variant;
  variant.k = request.settings.k;
  variant.false_color = request.show == Show::kFalseColor;
  variant.groups = std::max(1, photos_.group_count());
  variant.cameras_in_uniforms = static_cast<int>(sources_.views.size()) <= uniform_capacity_;
  variant.camera_capacity = variant.cameras_in_uniforms ? std::max(1, static_cast<int>(sources_.views.size())) : 1;
  program_ = &ProgramsFor(variant);

  glActiveTexture(GL_TEXTURE0 + kPlaceUnit);
  FillTextureBuffer(place_buffer_, place_texture_, GL_RGBA32UI, places);
  if (variant.cameras_in_uniforms) {
    if (!camera_block_) camera_block_ = GlBuffer::Make();
    rows.resize(static_cast<std::size_t>(variant.camera_capacity * kFloatsPerCamera));
    glBindBuffer(GL_UNIFORM_BUFFER, camera_block_.id());
    glBufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(rows.size() * sizeof(float)), rows.data(), GL_STREAM_DRAW);
  } else {
    FillTextureBuffer(camera_buffer_, camera_texture_, GL_RGBA32F, rows);
  }
  const Eigen::Matrix3f rays = setup.ray_from_pixel.cast<float>();
  const Eigen::Vector2i tiles = (size_px_.array() + (kTilePx - 1)) / kTilePx;
  const int tile_count = tiles.prod();
  const std::size_t tile_words = static_cast<std::size_t>(count) + 1, all_words = tile_words * static_cast<std::size_t>(tile_count);
  const bool culling = culling_ && all_words <= kMaxListWords;
  if (const std::size_t words = culling ? all_words : 1; words > list_words_) {
    if (!list_buffer_) list_buffer_ = GlBuffer::Make();
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, list_buffer_.id());
    glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(words * sizeof(std::uint32_t)), nullptr, GL_DYNAMIC_COPY);
    list_words_ = words;
  }
  const bool visibility = request.settings.visibility && request.settings.gamma > 0;
  for (const GlProgram* p : {&program_->blend, &program_->cull}) {
    p->Use();
    glUniformMatrix3fv(p->Uniform("ray_from_pixel"), 1, GL_FALSE, rays.data());
    glUniform1i(p->Uniform("camera_count"), count);
    glUniform1i(p->Uniform("tile_columns"), tiles.x());
    glUniform1i(p->Uniform("tile_words"), culling ? static_cast<int>(tile_words) : 0);
    glUniform1f(p->Uniform("gamma"), static_cast<float>(request.settings.gamma));
    glUniform2i(p->Uniform("visibility_size"), visibility ? visibility_size_.x() : 0, visibility ? visibility_size_.y() : 0);
  }
  program_->blend.Use();
  glUniform1f(program_->blend.Uniform("focal_px"), request.settings.prefilter ? setup.focal_px : 0.0F);
  if (culling) {
    BindInputs(target);
    program_->cull.Use();
    glUniform2i(program_->cull.Uniform("size_px"), size_px_.x(), size_px_.y());
    glUniform1i(program_->cull.Uniform("tile_count"), tile_count);
    glDispatchCompute(static_cast<GLuint>((tile_count + kTilesPerGroup - 1) / kTilesPerGroup), 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  }
  CheckGl("drawing the proxy");
}

void GlLumigraph::BindInputs(const GlTarget& target) const {
  glActiveTexture(GL_TEXTURE0 + kDepthUnit);
  glBindTexture(GL_TEXTURE_2D, target.depth_texture());
  glActiveTexture(GL_TEXTURE0 + kPlaceUnit);
  glBindTexture(GL_TEXTURE_BUFFER, place_texture_.id());
  glActiveTexture(GL_TEXTURE0 + kColorUnit);
  glBindTexture(GL_TEXTURE_BUFFER, color_texture_.id());
  if (visibility_texture_) {
    glActiveTexture(GL_TEXTURE0 + kVisibilityUnit);
    glBindTexture(GL_TEXTURE_BUFFER, visibility_texture_.id());
  }
  if (camera_texture_) {
    glActiveTexture(GL_TEXTURE0 + kCameraUnit);
    glBindTexture(GL_TEXTURE_BUFFER, camera_texture_.id());
  }
  if (camera_block_) glBindBufferBase(GL_UNIFORM_BUFFER, 0, camera_block_.id());
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, list_buffer_.id());
  photos_.Bind(kFirstPhotoUnit);
  glActiveTexture(GL_TEXTURE0);
}

void GlLumigraph::Blend(GlTarget& target, int first_row, int last_row) {
  if (program_ == nullptr) throw std::logic_error("GlLumigraph: Blend without Begin");
  glBindFramebuffer(GL_FRAMEBUFFER, target.color_framebuffer());
  glViewport(0, 0, size_px_.x(), size_px_.y());
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glEnable(GL_SCISSOR_TEST);
  glScissor(0, first_row, size_px_.x(), last_row - first_row);
  program_->blend.Use();
  BindInputs(target);
  glBindVertexArray(empty_array_.id());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindVertexArray(0);
  glDisable(GL_SCISSOR_TEST);
  CheckGl("blending");
}

ImageF GlLumigraph::ReadColor(const GlTarget& target, const Eigen::Vector2i& size_px) const {
  ImageF image(size_px.x(), size_px.y(), 4);
  glBindFramebuffer(GL_FRAMEBUFFER, target.color_framebuffer());
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(0, 0, size_px.x(), size_px.y(), GL_RGBA, GL_FLOAT, image.data.data());
  CheckGl("reading a picture back");
  return image;
}

float GlLumigraph::ReadDepth(const GlTarget& target, int x, int y) const {
  float depth = 0;
  glBindFramebuffer(GL_FRAMEBUFFER, target.depth_framebuffer());
  glReadPixels(x, y, 1, 1, GL_RED, GL_FLOAT, &depth);
  CheckGl("reading a depth back");
  return depth;
}

}  // namespace lumi
