// What is drawn over and around the lumigraph's picture: the backdrop behind holes, the photos' frusta, the proxy's
// edges.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "render/gl/gl_lumigraph.h"
#include "render/gl/hole_fill.h"
#include "render/radiance/sources.h"
#include "render/viewer/flat_surface.h"
#include "render/viewer/picture_texture.h"

namespace lumi {

// Everything is drawn into the framebuffer that is bound, whose size is window_px; right way up for a window.
class Overlay {
 public:
  Overlay();

  // The backdrop alone, where there is no picture yet.
  void PresentNothing(const Eigen::Vector2i& window_px);
  // The picture, stretched over the window, on a quiet grid where it is transparent.
  void Present(const GlTarget& target, const Eigen::Vector2i& picture_px, const Eigen::Vector2i& window_px);
  template <typename Picture>  // PictureTexture, FlatSurface
  void Present(const Picture& picture, const Eigen::Vector2i& window_px) {
    Present(picture.texture(), picture.size_px(), picture.size_px(), window_px);
  }

  void Present(const GlHoleFill& filled, const Eigen::Vector2i& window_px) {
    Present(filled.texture(), filled.capacity_px(), filled.size_px(), window_px);
  }

  struct Eye {
    RenderView view;         // normalised frame, at the window's size
    const GlTarget* target;  // its depth: lines behind the proxy are faint
    Eigen::Vector2i picture_px;
    Eigen::Vector2i window_px;
  };
  // Frusta of `depth` (normalised units); colours RGBA and quarter turns to the upright photo, one a source.
  void Frusta(const Eye& eye, const Sources& sources, const std::vector<Eigen::Vector4f>& colors,
              const std::vector<int>& quarter_turns, double depth);
  struct Line {
    Eigen::Vector3d a, b;  // normalised
    Eigen::Vector4f color;
  };
  void Lines(const Eye& eye, const std::vector<Line>& lines);
  // The pyramid of a view (normalised); returns the corners of its base.
  static std::array<Eigen::Vector3d, 4> AddFrustum(const RenderView& view, double depth, const Eigen::Vector4f& color,
                                                   std::vector<Line>& lines);
  void ProxyEdges(const Eye& eye, const GlLumigraph& lumigraph);

 private:
  void Present(unsigned texture, const Eigen::Vector2i& capacity_px, const Eigen::Vector2i& picture_px,
               const Eigen::Vector2i& window_px);
  void UseLines(const Eye& eye);
  GlProgram present_, lines_;
  GlVertexArray empty_, line_array_;
  GlBuffer line_buffer_;
};

}  // namespace lumi
