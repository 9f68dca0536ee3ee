// A lumigraph on the graphics processor. Either the proxy is rasterised to depth, and every pixel evaluates the weights
// of render/radiance/weights.h over all cameras (or its cell's, CandidatePlan) and blends their photographs; or the
// triangles of a SparsePlan are drawn with interpolated weights. Works in whatever OpenGL 4.3 core context is current
// (EGL offscreen, the viewer's window); every call, destructor included, on that context's thread.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "render/gl/blend_shader.h"
#include "render/gl/gl_objects.h"
#include "render/gl/gl_target.h"
#include "render/gl/photo_textures.h"
#include "render/gl/sparse_drawing.h"
#include "render/photos/photo_cache.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/sparse/candidate_plan.h"
#include "render/radiance/sparse/sparse_plan.h"
#include "render/radiance/visibility.h"
#include "render/world/renderer.h"

namespace lumi {

class GlLumigraph {
 public:
  // photo_sizes_px: level 0 of each photo as it will be uploaded, one a view. Photos that take more than `photo_bytes`
  // together come and go (slots()); unless small_halvings is negative, small copies of all stay. Throws MachineError
  // without OpenGL 4.3, or without room for the photos.
  GlLumigraph(const Sources& cameras, const std::vector<Eigen::Vector2i>& photo_sizes_px,
              std::size_t photo_bytes = std::numeric_limits<std::size_t>::max(), int small_halvings = -1);

  void SetProxy(const Mesh& proxy);  // replaces the one before; throws std::invalid_argument (Validate)
  // With its visibility maps (empty: it hides nothing) and, if there is one, its tracer. Both are slow to make, so the
  // caller may make them elsewhere; they are shared, not copied.
  void SetProxy(const Mesh& proxy, std::shared_ptr<const VisibilityMaps> maps,
                std::shared_ptr<const ProxyTracer> tracer = nullptr);
  void SetCameras(
      const Sources& cameras);  // as many, where poses, exposures or grids changed; a proxy in their world must follow
  void Upload(ViewId view, const Photo& photo);  // may replace a photo; no larger than planned
  // nullptr if all photos are held. Otherwise photos come and go: WantPhotos, then Offer for what slots()->missing().
  const PhotoSlots* slots() const { return slots_ ? &*slots_ : nullptr; }
  // The most important ones first. What may be halved as often as its small copy is not missing.
  void WantPhotos(std::span<const WantedPhoto> wanted);
  void UploadSmallCopy(ViewId view, const Photo& copy);
  // Uploads the photo, halved so often, if that is still wanted; others may go for it.
  void Offer(ViewId view, const Photo& photo, int halvings);
  void GiveUp(ViewId view);  // it cannot be read
  void DropPhotos();         // all
  bool Has(ViewId view) const { return photos_.places()[static_cast<std::size_t>(view.value)].loaded; }
  std::size_t photo_bytes() const { return photos_.bytes_loaded(); }
  int photo_count() const { return loaded_; }
  const Sources& sources() const { return sources_; }
  const std::shared_ptr<const VisibilityMaps>& visibility() const { return visibility_; }

  // One colour a view for Show::kFalseColor; SourceColor() unless set.
  void SetSourceColors(const std::vector<Eigen::Vector3f>& colors);

  // The photos that a picture of this request shows, whether they are uploaded or not, and how often each may be
  // halved; those that show in the most places first. They are ranked at the samples of the settings' grid, or of
  // 25x25, as candidates are (PlanCandidates): a photo that is among the best only between samples is missed.
  std::vector<WantedPhoto> PhotosWanted(const RenderRequest& request);

  // Starts a picture of request.view.size_px: the depth of every pixel, or the plan of settings.Sparse(). Views whose
  // photo is not uploaded are left out (colour). Throws std::invalid_argument for a singular view or settings out of
  // range, UsageError for what the shaders do not do: the optimum at every pixel.
  void Begin(const RenderRequest& request, GlTarget& target);
  // The same with a plan made elsewhere, for the same view, settings and photos.
  void Begin(const RenderRequest& request, const SparsePlan& plan, GlTarget& target);
  void Begin(const RenderRequest& request, const CandidatePlan& plan, GlTarget& target);
  // Blends rows [first, last) of the picture begun last, in the same target.
  void Blend(GlTarget& target, int first_row, int last_row);

  // Statistics of the picture begun last; the caller fills blend_ms.
  const RenderStatistics& statistics() const { return statistics_; }

  // Whether pixels look at their tile's cameras only (CullComputeShader), on unless set. The picture is the same.
  void SetCulling(bool on) { culling_ = on; }
  // Whether pixels are blended by a compute shader, on from the start where a graphics processor draws. The picture is
  // the same, but for rounding.
  void SetComputing(bool on) { computing_ = on; }

  ImageF ReadColor(const GlTarget& target, const Eigen::Vector2i& size_px) const;
  // Depth along the optical axis, normalised units; 0 where the proxy is missed.
  float ReadDepth(const GlTarget& target, int x, int y) const;

  // The proxy's triangles for an overlay: vertex array bound by the caller, positions (normalised) at location 0.
  unsigned proxy_vertex_array() const { return mesh_array_.id(); }
  int proxy_index_count() const { return index_count_; }

 private:
  struct Programs {
    GlProgram blend, cull;
    bool computes;  // blend is a compute shader
  };
  const Programs& ProgramsFor(const BlendVariant& variant);
  const GlProgram& SparseProgramFor(const SparseVariant& variant);
  void Prepare(const GlProgram& program, const BlendVariant& variant) const;
  void BindInputs(const GlTarget& target) const;
  void UploadFields();
  void Drop(ViewId view);
  void UploadVisibility(std::shared_ptr<const VisibilityMaps> maps);

  ViewSetup Start(const RenderRequest& request);
  BlendVariant VariantFor(const RenderRequest& request) const;
  void UploadCameras(const ViewSetup& setup, const BlendVariant& variant);
  void DrawDepth(const ViewSetup& setup, GlTarget& target, bool faces);
  void SetUniforms(const ViewSetup& setup, const GlProgram& program, const BlendVariant& variant) const;
  void BeginPixels(const RenderRequest& request, const ViewSetup& setup, GlTarget& target);
  void BeginCells(const RenderRequest& request, const ViewSetup& setup, const CandidatePlan& plan, GlTarget& target);
  void BeginTriangles(const RenderRequest& request, const ViewSetup& setup, const SparsePlan& plan, GlTarget& target);
  void MakeSamplers();  // of the proxy, unless there are some
  void UploadLeaves(const RadianceSettings& settings);
  void ReserveLists(std::size_t words);
  void ComputePixels(const GlTarget& target, int first_row, int last_row) const;
  void DrawLines(GlTarget& target);

  Sources sources_;
  PhotoTextures photos_;
  std::optional<PhotoSlots> slots_;  // unless all photos are held
  int small_halvings_;
  int loaded_ = 0;
  std::vector<Eigen::Vector3f> colors_;

  GlBuffer vertices_, indices_, normals_;
  GlVertexArray mesh_array_, empty_array_;
  int index_count_ = 0;

  Mesh proxy_;
  std::optional<SparseProxy> sparse_proxy_;    // made when first wanted
  std::shared_ptr<const ProxyTracer> tracer_;  // the same
  SparsePlan sparse_plan_;
  CandidatePlan candidate_plan_;

  GlProgram depth_program_, face_program_, line_program_;
  std::map<BlendVariant, Programs> programs_;
  std::map<SparseVariant, GlProgram> sparse_programs_;
  int uniform_capacity_ = 0;  // rows of cameras that a uniform block holds
  std::shared_ptr<const VisibilityMaps> visibility_ =
      std::make_shared<const VisibilityMaps>();  // empty: the proxy hides nothing
  GlBuffer visibility_buffer_;                   // VisibilityMaps, one map after another
  GlTexture visibility_texture_;
  GlBuffer field_buffer_;  // PhotoFields, one after another, and where each measure's lies
  GlTexture field_texture_;
  std::array<Eigen::Vector3i, MeasureList::kCount> field_places_;
  GlBuffer camera_block_, camera_buffer_, place_buffer_, color_buffer_, list_buffer_;
  GlBuffer leaf_buffer_;  // of the radii, r_min and r_max
  std::pair<double, double> leaf_radii_;
  Eigen::Vector2d leaf_place_ = Eigen::Vector2d::Zero();
  std::size_t list_words_ = 0, max_list_words_ = 0;
  bool culling_ = true, computing_;
  GlTexture camera_texture_, place_texture_, color_texture_, list_texture_;

  // The picture begun last.
  RenderStatistics statistics_;
  std::vector<int> packed_views_;      // of the cameras on the GPU
  const Programs* program_ = nullptr;  // nullptr: triangles_ are drawn
  SparseDrawing triangles_;
  PlanLines lines_;
  Eigen::Vector2i size_px_ = Eigen::Vector2i::Zero();
};

// A program that draws what lies in the normalised frame ("centre", "clip_from_offset") as this view sees it; M: its
// matrix, scaled as the depth is to be.
void UseFor(const GlProgram& program, const Eigen::Matrix3d& M, const RenderView& view);

// Four floats a row, as the shaders read them; `views`: which, in order of their distance to the desired camera (near
// ones first make the search for the nearest rays short).
void PackCameras(const ViewSetup& setup, int rows_a_camera, std::vector<float>& rows, std::vector<int>& views);

}  // namespace lumi
