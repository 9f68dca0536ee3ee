#include "render/gl/gl_lumigraph.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "render/gl/gl_lumigraph_parts.h"
#include "render/gl/shader_parts.h"
#include "render/radiance/sources.h"
#include "render/world/photos_wanted.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kMaxUniformRows = 4 * 1024;
constexpr unsigned kLeastCapacity = 64;  // cameras: 4 KB
// 128 MB of lists: beyond it (a thousand cameras and a picture of 32 megapixels) pixels look at all cameras.
constexpr std::size_t kMaxListWords = std::size_t(1) << 25;
constexpr int kWantedColumns = 25, kWantedRows = 25;
constexpr int kWantedOfAll = 8;  // photos a ray, where k is "all"

}  // namespace

GlLumigraph::GlLumigraph(const Sources& cameras, const std::vector<Eigen::Vector2i>& photo_sizes_px,
                         std::size_t photo_bytes, int small_halvings)
    : sources_((RequireGl43(), cameras)),
      photos_(photo_sizes_px, photo_bytes, small_halvings),
      small_halvings_(small_halvings),
      computing_(!GlIsSoftware()) {
  if (!photos_.holds_all()) slots_.emplace(photos_.kinds(), photos_.rooms());
  if (photo_sizes_px.size() != cameras.views.size())
    throw std::invalid_argument("GlLumigraph: one photo size a view is wanted");
  GLint block_bytes = 16384;
  glGetIntegerv(GL_MAX_UNIFORM_BLOCK_SIZE, &block_bytes);
  uniform_capacity_ = std::min<int>(kMaxUniformRows, block_bytes / (kFloatsPerRow * static_cast<int>(sizeof(float))));
  GLint texels = 65536;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
  max_list_words_ = std::min(kMaxListWords, static_cast<std::size_t>(texels));
  depth_program_ = GlProgram("depth", DepthVertexShader(), DepthFragmentShader(false));
  empty_array_ = GlVertexArray::Make();
  std::vector<Eigen::Vector3f> colors;
  for (std::size_t i = 0; i < cameras.views.size(); ++i) colors.push_back(SourceColor(static_cast<int>(i)));
  SetSourceColors(colors);
  UploadFields();
  CheckGl("preparing to draw");
}

// What does not change from picture to picture.
void GlLumigraph::Prepare(const GlProgram& program, const BlendVariant& variant) const {
  program.Use();
  glUniform1i(program.Uniform("depth_map"), kDepthUnit);
  glUniform1i(program.Uniform("places"), kPlaceUnit);
  glUniform1i(program.Uniform("source_colors"), kColorUnit);
  glUniform1i(program.Uniform("visibility_maps"), kVisibilityUnit);
  glUniform1i(program.Uniform("face_map"), kFaceUnit);
  glUniform1i(program.Uniform("lists"), kListUnit);
  glUniform1i(program.Uniform("photo_fields"), kFieldUnit);
  glUniform1i(program.Uniform("projections"), kProjectionUnit);
  glUniform1i(program.Uniform("record_places"), kRecordUnit);
  if (variant.cameras_in_uniforms) {
    const GLuint block = glGetUniformBlockIndex(program.id(), "Cameras");
    if (block != GL_INVALID_INDEX) glUniformBlockBinding(program.id(), block, 0);
  } else {
    glUniform1i(program.Uniform("cameras"), kCameraUnit);
  }
  if (!variant.false_color) {
    std::vector<GLint> units, sizes;
    for (int g = 0; g < photos_.group_count(); ++g) {
      units.push_back(kFirstPhotoUnit + g);
      sizes.push_back(photos_.GroupSize(g).x());
      sizes.push_back(photos_.GroupSize(g).y());
    }
    glUniform1iv(program.Uniform("photos"), static_cast<GLsizei>(units.size()), units.data());
    glUniform2iv(program.Uniform("group_size"), static_cast<GLsizei>(units.size()), sizes.data());
  }
  CheckGl("compiling the shaders");
}

const GlLumigraph::Programs& GlLumigraph::ProgramsFor(const BlendVariant& variant) {
  auto found = programs_.find(variant);
  if (found == programs_.end()) {
    Programs programs{variant.compute ? GlProgram("blend", BlendComputeShader(variant))
                                      : GlProgram("blend", FullScreenVertexShader(), BlendFragmentShader(variant)),
                      GlProgram(), variant.compute};
    Prepare(programs.blend, variant);
    if (variant.lists == CameraLists::kTiles) {
      programs.cull = GlProgram("cull", CullComputeShader(variant));
      Prepare(programs.cull, variant);
    }
    found = programs_.emplace(variant, std::move(programs)).first;
  }
  return found->second;
}

const GlProgram& GlLumigraph::SparseProgramFor(const SparseVariant& variant) {
  auto found = sparse_programs_.find(variant);
  if (found == sparse_programs_.end()) {
    GlProgram program("sparse", SparseVertexShader(variant), SparseFragmentShader(variant));
    Prepare(program, variant.blend);
    found = sparse_programs_.emplace(variant, std::move(program)).first;
  }
  return found->second;
}

ViewSetup GlLumigraph::Start(const RenderRequest& request) {
  size_px_ = request.view.size_px;
  if (size_px_.minCoeff() <= 0) throw std::invalid_argument("GlLumigraph: the view has no size");
  std::vector<bool> use = request.use;
  if (request.show != Show::kFalseColor) {
    if (use.empty()) use.assign(sources_.views.size(), true);
    for (std::size_t j = 0; j < use.size() && j < photos_.places().size(); ++j)
      use[j] = use[j] && photos_.places()[j].loaded;
  }
  statistics_ = {};
  lines_.Clear();
  program_ = nullptr;
  return MakeViewSetup(sources_, request.view, request.settings, use);
}

BlendVariant GlLumigraph::VariantFor(const RenderRequest& request) const {
  const RadianceSettings& s = request.settings;
  BlendVariant variant;
  variant.k = s.k;
  variant.false_color = request.show == Show::kFalseColor;
  variant.groups = std::max(1, photos_.group_count());
  variant.whole_layers = !variant.false_color && photos_.WholeLayers();
  variant.correlation = s.correlation;
  variant.field_of_view = s.field_of_view;
  variant.visibility = s.visibility && s.gamma > 0 && !visibility_->empty();
  ForEachTerm([&]<typename M> {
    if (!(M::Factor(s) > 0)) return;
    if constexpr (PixelTerm<M>)
      variant.terms.Add<M>();
    else
      variant.photo_terms = true;
    if constexpr (ReadsStretch<M>)
      variant.stretch = s.resolution == Resolution::kJacobian ? Resolution::kJacobian : Resolution::kDistance;
  });
  variant.exposure = s.exposure && !variant.false_color;
  variant.prefilter = s.prefilter && !variant.false_color;
  variant.compute = computing_;
  const auto count = static_cast<unsigned>(sources_.views.size());
  const unsigned most = static_cast<unsigned>(uniform_capacity_ / CameraRows(variant));
  variant.cameras_in_uniforms = count <= most;
  // Rounded up in steps, so that the driver can reuse a shader it compiled for another scene.
  variant.camera_capacity = 1;
  if (variant.cameras_in_uniforms)
    variant.camera_capacity = static_cast<int>(std::min(std::bit_ceil(std::max(count, kLeastCapacity)), most));
  return variant;
}

void UseFor(const GlProgram& program, const Eigen::Matrix3d& M, const RenderView& view) {
  // Pixels to clip units; the picture's first row is GL's first.
  Eigen::Matrix3d clip_from_pixel = Eigen::Matrix3d::Identity();
  clip_from_pixel(0, 0) = 2.0 / view.size_px.x();
  clip_from_pixel(1, 1) = 2.0 / view.size_px.y();
  clip_from_pixel(0, 2) = clip_from_pixel(1, 2) = -1.0;
  const Eigen::Matrix3f clip = (clip_from_pixel * M).cast<float>();
  const Eigen::Vector3f centre = view.centre.cast<float>();
  program.Use();
  glUniform3fv(program.Uniform("centre"), 1, centre.data());
  glUniformMatrix3fv(program.Uniform("clip_from_offset"), 1, GL_FALSE, clip.data());
}

void GlLumigraph::DrawDepth(const ViewSetup& setup, GlTarget& target, bool faces) {
  target.Reserve(size_px_, faces);
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
  const GLuint no_face[4] = {0, 0, 0, 0};
  glClearBufferfv(GL_COLOR, 0, nothing);
  if (faces) glClearBufferuiv(GL_COLOR, 1, no_face);
  glClearBufferfv(GL_DEPTH, 0, nothing);
  if (index_count_ > 0) {
    if (faces && !face_program_)
      face_program_ = GlProgram("depth and face", DepthVertexShader(), DepthFragmentShader(true));
    const GlProgram& program = faces ? face_program_ : depth_program_;
    UseFor(program, setup.desired.P.leftCols<3>(), setup.desired);
    glBindVertexArray(mesh_array_.id());
    glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
  }
  glDisable(GL_DEPTH_TEST);
}

void GlLumigraph::SetUniforms(const ViewSetup& setup, const GlProgram& program, const BlendVariant& variant) const {
  const RadianceSettings& s = setup.settings;
  program.Use();
  const Eigen::Matrix3f rays = setup.ray_from_pixel.cast<float>();
  glUniformMatrix3fv(program.Uniform("ray_from_pixel"), 1, GL_FALSE, rays.data());
  glUniform1i(program.Uniform("camera_count"), static_cast<int>(packed_views_.size()));
  glUniform1f(program.Uniform("alpha_weight"), static_cast<float>(s.alpha));
  glUniform1f(program.Uniform("gamma"), static_cast<float>(s.gamma));
  glUniform1f(program.Uniform("focal_px"), setup.focal_px);
  if (variant.correlation == Correlation::kFallingLeaves) {
    glUniform2f(program.Uniform("leaf_place"), static_cast<float>(leaf_place_.x()),
                static_cast<float>(leaf_place_.y()));
    glUniform1f(program.Uniform("r_max"), static_cast<float>(s.r_max_rad));
  }
  if (variant.visibility) glUniform2i(program.Uniform("visibility_size"), visibility_->width(), visibility_->height());
  if (variant.stretch != Resolution::kOff) {
    const Eigen::Matrix3f view = setup.desired.P.leftCols<3>().cast<float>();
    glUniform1f(program.Uniform("view_focal_px"), setup.focal_px);
    glUniformMatrix3fv(program.Uniform("view_from_offset"), 1, GL_FALSE, view.data());
  }
  ForEachTerm([&]<typename M> {
    if constexpr (PixelTerm<M>) {
      if (!variant.terms.Has<M>()) return;
      glUniform1f(program.Uniform(shader::ScaleOf(M::kName).c_str()),
                  static_cast<float>(M::Factor(s) * 2 * s.r_max_rad));
      glUniform4fv(program.Uniform(shader::ShapeOf(M::kName).c_str()), 1, M::ShapeOf(s).Packed().data());
      glUniform3iv(program.Uniform(shader::FieldOf(M::kName).c_str()), 1,
                   field_places_[MeasureList::IndexOf<M>()].data());
    }
  });
}

std::vector<WantedPhoto> GlLumigraph::PhotosWanted(const RenderRequest& request) {
  RadianceSettings s = request.settings;
  s.similarity = Similarity::kIdentity;
  s.sampling = Sampling::kCandidates;
  if (!s.Sparse()) {
    s.grid_columns = kWantedColumns;
    s.grid_rows = kWantedRows;
  }
  if (s.k <= 0) s.k = kWantedOfAll;
  MakeSamplers();
  const VisibilityMaps* visibility = s.visibility && !visibility_->empty() ? visibility_.get() : nullptr;
  CandidatePlan plan;
  const ViewSetup setup = MakeViewSetup(sources_, request.view, s, request.use);
  PlanCandidates(setup, *sparse_proxy_, *tracer_, visibility, ParallelFor, plan);
  return lumi::PhotosWanted(plan, setup, *tracer_);
}

void GlLumigraph::MakeSamplers() {
  if (!sparse_proxy_) sparse_proxy_.emplace(proxy_, sources_.normalized_from_world);
  if (!tracer_) tracer_ = std::make_shared<const ProxyTracer>(proxy_, sources_.normalized_from_world);
}

void GlLumigraph::Begin(const RenderRequest& request, GlTarget& target) {
  const ViewSetup setup = Start(request);
  const RadianceSettings& s = request.settings;
  const bool interpolated = s.Sparse() && s.sampling == Sampling::kInterpolated;
  const bool cells =
      s.Sparse() && s.sampling == Sampling::kCandidates && s.k > 0;  // k "all" leaves no photos to choose
  RequireDrawnByGl(s);
  if (!interpolated && !cells) return BeginPixels(request, setup, target);
  const auto start = std::chrono::steady_clock::now();
  MakeSamplers();
  const VisibilityMaps* visibility = s.visibility && !visibility_->empty() ? visibility_.get() : nullptr;
  if (cells)
    PlanCandidates(setup, *sparse_proxy_, *tracer_, visibility, ParallelFor, candidate_plan_);
  else
    PlanSparse(setup, *sparse_proxy_, visibility, ParallelFor, sparse_plan_);
  const auto planned = std::chrono::steady_clock::now();
  if (cells)
    BeginCells(request, setup, candidate_plan_, target);
  else
    BeginTriangles(request, setup, sparse_plan_, target);
  statistics_.plan_ms = std::chrono::duration<double, std::milli>(planned - start).count();
}

void GlLumigraph::Begin(const RenderRequest& request, const SparsePlan& plan, GlTarget& target) {
  BeginTriangles(request, Start(request), plan, target);
}

void GlLumigraph::Begin(const RenderRequest& request, const CandidatePlan& plan, GlTarget& target) {
  BeginCells(request, Start(request), plan, target);
}

void GlLumigraph::BeginPixels(const RenderRequest& request, const ViewSetup& setup, GlTarget& target) {
  const BlendVariant variant = VariantFor(request);
  DrawDepth(setup, target, variant.Faces());
  UploadCameras(setup, variant);
  const Programs& programs = ProgramsFor(variant);
  program_ = &programs;
  const Eigen::Vector2i tiles = (size_px_.array() + (kTilePx - 1)) / kTilePx;
  const int tile_count = tiles.prod();
  const std::size_t tile_words = packed_views_.size() + 1,
                    all_words = tile_words * static_cast<std::size_t>(tile_count);
  // With field of view off, a photo also counts where it does not see the point, so tiles cannot leave it out.
  const bool culling = culling_ && request.settings.field_of_view && all_words <= max_list_words_;
  if (const std::size_t words = culling ? all_words : 1; words > list_words_) ReserveLists(words);
  for (const GlProgram* p : {&programs.blend, &programs.cull}) {
    SetUniforms(setup, *p, variant);
    glUniform1i(p->Uniform("tile_columns"), tiles.x());
    glUniform1i(p->Uniform("tile_words"), culling ? static_cast<int>(tile_words) : 0);
  }
  if (culling) {
    BindInputs(target);
    programs.cull.Use();
    glUniform2i(programs.cull.Uniform("size_px"), size_px_.x(), size_px_.y());
    glUniform1i(programs.cull.Uniform("tile_count"), tile_count);
    glDispatchCompute(static_cast<GLuint>((tile_count + kTilesPerGroup - 1) / kTilesPerGroup), 1, 1);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
  }
  CheckGl("drawing the proxy");
}

void GlLumigraph::BeginCells(const RenderRequest& request, const ViewSetup& setup, const CandidatePlan& plan,
                             GlTarget& target) {
  BlendVariant variant = VariantFor(request);
  variant.lists = CameraLists::kCells;
  DrawDepth(setup, target, variant.Faces());
  UploadCameras(setup, variant);
  const Programs& programs = ProgramsFor(variant);
  std::vector<int> packed(sources_.views.size(), -1);
  for (std::size_t i = 0; i < packed_views_.size(); ++i)
    packed[static_cast<std::size_t>(packed_views_[i])] = static_cast<int>(i);
  const std::size_t cells = static_cast<std::size_t>(plan.cell_columns) * static_cast<std::size_t>(plan.cell_rows);
  std::vector<std::uint32_t> words(cells + 1);
  words.reserve(words.size() + plan.camera.size());
  for (std::size_t cell = 0; cell < cells; ++cell) {
    for (std::int32_t i = plan.first[cell]; i < plan.first[cell + 1]; ++i)
      if (const int p = packed[static_cast<std::size_t>(plan.camera[static_cast<std::size_t>(i)])]; p >= 0)
        words.push_back(static_cast<std::uint32_t>(p));
    words[cell + 1] = static_cast<std::uint32_t>(words.size() - cells - 1);
  }
  ReserveLists(words.size());
  glBufferSubData(GL_TEXTURE_BUFFER, 0, static_cast<GLsizeiptr>(words.size() * sizeof(std::uint32_t)), words.data());
  SetUniforms(setup, programs.blend, variant);
  glUniform2i(programs.blend.Uniform("cell_count"), plan.cell_columns, plan.cell_rows);
  glUniform2f(programs.blend.Uniform("cells_per_px"), static_cast<float>(1 / plan.cell_width_px),
              static_cast<float>(1 / plan.cell_height_px));
  if (request.show == Show::kTessellation) lines_.Set(plan, size_px_);
  statistics_.samples = plan.samples;
  program_ = &programs;
  CheckGl("uploading the candidates");
}

void GlLumigraph::BeginTriangles(const RenderRequest& request, const ViewSetup& setup, const SparsePlan& plan,
                                 GlTarget& target) {
  SparseVariant variant;
  const BlendVariant all = VariantFor(request);
  // Settings that only the plan reads do not distinguish these shaders.
  variant.blend.k = 0;
  variant.blend.false_color = all.false_color;
  variant.blend.groups = all.groups;
  variant.blend.exposure = all.exposure;
  variant.blend.prefilter = all.prefilter;
  variant.blend.cameras_in_uniforms = all.cameras_in_uniforms;
  variant.blend.camera_capacity = all.camera_capacity;
  variant.negative = request.settings.similarity == Similarity::kFull;
  variant.ends = request.settings.field_of_view ? PhotoEnds::kFeather : PhotoEnds::kCut;
  variant.blend.whole_layers = all.whole_layers;
  UploadCameras(setup, variant.blend);
  triangles_.Upload(plan, setup, packed_views_, photos_, variant);
  for (const SparseDrawing::Batch& batch : triangles_.batches())
    SetUniforms(setup, SparseProgramFor(batch.variant), batch.variant.blend);
  if (request.show == Show::kTessellation) lines_.Set(plan, size_px_);
  statistics_.samples = plan.samples;
  statistics_.triangles = static_cast<long>(plan.triangles.size());
  statistics_.optimum = plan.optimum;

  target.Reserve(size_px_);
  glBindFramebuffer(GL_FRAMEBUFFER, target.both_framebuffer());
  glDisable(GL_SCISSOR_TEST);
  glDepthMask(GL_TRUE);
  const float nothing[4] = {0, 0, 0, 0};
  glClearBufferfv(GL_COLOR, 0, nothing);
  glClearBufferfv(GL_COLOR, 1, nothing);
  if (triangles_.overlapping()) glClearBufferfv(GL_DEPTH, 0, nothing);
  CheckGl("uploading the triangles");
}

void GlLumigraph::BindInputs(const GlTarget& target) const {
  const auto bind = [](int unit, GLenum kind, unsigned id) {
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
    glBindTexture(kind, id);
  };
  bind(kDepthUnit, GL_TEXTURE_2D, program_ != nullptr ? target.depth_texture() : 0);  // else it is drawn to
  bind(kPlaceUnit, GL_TEXTURE_BUFFER, place_texture_.id());
  bind(kFaceUnit, GL_TEXTURE_2D, target.face_texture());
  bind(kColorUnit, GL_TEXTURE_BUFFER, color_texture_.id());
  if (visibility_texture_) bind(kVisibilityUnit, GL_TEXTURE_BUFFER, visibility_texture_.id());
  if (field_texture_) bind(kFieldUnit, GL_TEXTURE_BUFFER, field_texture_.id());
  if (camera_texture_) bind(kCameraUnit, GL_TEXTURE_BUFFER, camera_texture_.id());
  if (program_ == nullptr) {
    bind(kProjectionUnit, GL_TEXTURE_BUFFER, triangles_.projection_texture());
    bind(kRecordUnit, GL_TEXTURE_BUFFER, triangles_.place_texture());
  }
  if (camera_block_) glBindBufferBase(GL_UNIFORM_BUFFER, 0, camera_block_.id());
  if (list_buffer_) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, list_buffer_.id());  // as it is written
    bind(kListUnit, GL_TEXTURE_BUFFER, list_texture_.id());            // as it is read
  }
  if (leaf_buffer_) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, leaf_buffer_.id());
  if (normals_) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, normals_.id());
  photos_.Bind(kFirstPhotoUnit);
  glActiveTexture(GL_TEXTURE0);
}

namespace {

// Depth is tested as near / depth, 0 far away. Where the driver's clip space can be told to be [0, 1], small values
// keep their digits.
class ReversedDepth {
 public:
  ReversedDepth() : exact_(epoxy_gl_version() >= 45 || epoxy_has_gl_extension("GL_ARB_clip_control")) {
    if (exact_) glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_TRUE);
  }
  ~ReversedDepth() {
    glDisable(GL_DEPTH_TEST);
    if (exact_) glClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
  }
  ReversedDepth(const ReversedDepth&) = delete;
  ReversedDepth& operator=(const ReversedDepth&) = delete;
  void Tell(const GlProgram& program) const {
    glUniform2f(program.Uniform("z_from_depth"), exact_ ? 1.0F : 2.0F, exact_ ? 0.0F : -1.0F);
  }

 private:
  bool exact_;
};

}  // namespace

void GlLumigraph::Blend(GlTarget& target, int first_row, int last_row) {
  if (program_ == nullptr && !triangles_.vertex_array()) throw std::logic_error("GlLumigraph: Blend without Begin");
  glViewport(0, 0, size_px_.x(), size_px_.y());
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  glEnable(GL_SCISSOR_TEST);
  glScissor(0, first_row, size_px_.x(), last_row - first_row);
  BindInputs(target);
  if (program_ != nullptr && program_->computes) {
    ComputePixels(target, first_row, last_row);
  } else if (program_ != nullptr) {
    glBindFramebuffer(GL_FRAMEBUFFER, target.color_framebuffer());
    program_->blend.Use();
    glBindVertexArray(empty_array_.id());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  } else {
    glBindFramebuffer(GL_FRAMEBUFFER, target.both_framebuffer());
    const ReversedDepth depth;
    if (!triangles_.overlapping()) glDisable(GL_DEPTH_TEST);
    glBindVertexArray(triangles_.vertex_array());
    for (const SparseDrawing::Batch& batch : triangles_.batches()) {
      const GlProgram& program = SparseProgramFor(batch.variant);
      program.Use();
      depth.Tell(program);
      glDrawArrays(GL_TRIANGLES, batch.first_vertex, batch.vertex_count);
    }
  }
  glBindVertexArray(0);
  if (!lines_.empty()) DrawLines(target);
  glDisable(GL_SCISSOR_TEST);
  CheckGl("blending");
}

void GlLumigraph::ComputePixels(const GlTarget& target, int first_row, int last_row) const {
  const auto groups = [](int px) { return static_cast<GLuint>((px + kBlendGroupPx - 1) / kBlendGroupPx); };
  program_->blend.Use();
  // What was drawn to the picture, looked up in it or stored before is done with.
  glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
  glUniform3i(program_->blend.Uniform("picture_rows"), first_row, last_row, size_px_.x());
  glBindImageTexture(0, target.color_texture(), 0, GL_FALSE, 0, GL_WRITE_ONLY, GL_RGBA32F);
  glDispatchCompute(groups(size_px_.x()), groups(last_row - first_row), 1);
  // It is read back, drawn over (lines), or looked up in the viewer's window.
  glMemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);
}

void GlLumigraph::DrawLines(GlTarget& target) {
  if (!line_program_) line_program_ = GlProgram("lines", LineVertexShader(), LineFragmentShader());
  glBindFramebuffer(GL_FRAMEBUFFER, target.color_framebuffer());
  line_program_.Use();
  lines_.Draw();
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
