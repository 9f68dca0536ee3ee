// A lumigraph on the graphics processor: the proxy is rasterised to depth, then every pixel evaluates the weights of
// render/radiance/weights.h over all cameras and blends their photographs. Works in whatever OpenGL 4.3 core context is
// current (EGL offscreen, the viewer's window); every call, destructor included, on that context's thread.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "render/gl/blend_shader.h"
#include "render/gl/gl_objects.h"
#include "render/gl/photo_textures.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/visibility.h"
#include "render/renderer.h"

namespace lumi {

// Where a picture is drawn: RGBA float, premultiplied, first row on top; and the depth along the optical axis in
// normalised units (0: the proxy is missed). Grows, never shrinks.
class GlTarget {
 public:
  void Reserve(const Eigen::Vector2i& size_px);
  const Eigen::Vector2i& capacity_px() const { return capacity_px_; }
  unsigned depth_framebuffer() const { return depth_framebuffer_.id(); }
  unsigned color_framebuffer() const { return color_framebuffer_.id(); }
  unsigned depth_texture() const { return depth_.id(); }
  unsigned color_texture() const { return color_.id(); }

 private:
  Eigen::Vector2i capacity_px_ = Eigen::Vector2i::Zero();
  GlTexture depth_, depth_test_, color_;
  GlFramebuffer depth_framebuffer_, color_framebuffer_;
};

class GlLumigraph {
 public:
  // photo_sizes_px: level 0 of each photo as it will be uploaded, one a view. Throws MachineError without OpenGL 4.3.
  GlLumigraph(const Scene& scene, const std::vector<Eigen::Vector2i>& photo_sizes_px);

  void SetProxy(const Mesh& proxy);                  // replaces the one before; throws std::invalid_argument (Validate)
  // With the maps of what each photo sees of it, made elsewhere (ProxyVisibility), as they take their time.
  void SetProxy(const Mesh& proxy, VisibilityMaps maps);
  void SetGains(const std::vector<double>& gains);   // one a view: the photos' exposures, where they became known later
  void Upload(ViewId view, const Photo& photo);
  bool Has(ViewId view) const { return photos_.places()[static_cast<std::size_t>(view.value)].loaded; }
  std::size_t photo_bytes() const { return photos_.bytes_loaded(); }
  int photo_count() const { return loaded_; }
  const Sources& sources() const { return sources_; }

  // One colour a view for Show::kFalseColor; SourceColor() unless set.
  void SetSourceColors(const std::vector<Eigen::Vector3f>& colors);

  // Starts a picture of request.view.size_px: the depth of every pixel. Views whose photo is not uploaded are left out
  // (colour). Throws std::invalid_argument for a singular view or settings out of range.
  void Begin(const RenderRequest& request, GlTarget& target);
  // Blends rows [first, last) of the picture begun last, in the same target.
  void Blend(GlTarget& target, int first_row, int last_row);

  // Whether pixels look at their tile's cameras only (CullComputeShader), on unless set. The picture is the same.
  void SetCulling(bool on) { culling_ = on; }

  ImageF ReadColor(const GlTarget& target, const Eigen::Vector2i& size_px) const;
  // Depth along the optical axis, normalised units; 0 where the proxy is missed.
  float ReadDepth(const GlTarget& target, int x, int y) const;

  // The proxy's triangles for an overlay: vertex array bound by the caller, positions (normalised) at location 0.
  unsigned proxy_vertex_array() const { return mesh_array_.id(); }
  int proxy_index_count() const { return index_count_; }

 private:
  struct Programs {
    GlProgram blend, cull;
  };
  const Programs& ProgramsFor(const BlendVariant& variant);
  void Prepare(const GlProgram& program, const BlendVariant& variant) const;
  void BindInputs(const GlTarget& target) const;
  void UploadVisibility(VisibilityMaps maps);

  Sources sources_;
  PhotoTextures photos_;
  int loaded_ = 0;
  std::vector<Eigen::Vector3f> colors_;

  GlBuffer vertices_, indices_;
  GlVertexArray mesh_array_, empty_array_;
  int index_count_ = 0;

  GlProgram depth_program_;
  std::map<BlendVariant, Programs> programs_;
  int uniform_capacity_ = 0;                          // cameras that a uniform block holds
  GlBuffer visibility_buffer_;                        // VisibilityMaps, one map after another
  GlTexture visibility_texture_;
  Eigen::Vector2i visibility_size_ = Eigen::Vector2i::Zero();  // of a map; 0: the proxy hides nothing
  GlBuffer camera_block_, camera_buffer_, place_buffer_, color_buffer_, list_buffer_;
  std::size_t list_words_ = 0;
  bool culling_ = true;
  GlTexture camera_texture_, place_texture_, color_texture_;

  // The picture begun last.
  const Programs* program_ = nullptr;
  Eigen::Vector2i size_px_ = Eigen::Vector2i::Zero();
};

// Four floats a row, four rows a camera, as the blend shader reads them; `views`: which, in order of their distance to
// the desired camera (near ones first make the search for the nearest rays short).
void PackCameras(const RelativeSources& sources, std::vector<float>& rows, std::vector<int>& views);

}  // namespace lumi
