#include "render/lumigraph/per_view_renderer.h"

#include <algorithm>
#include <utility>

#include "render/picture/convert.h"
#include "scene/program/parallel.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

constexpr int kTilePx = 32;           // px; holes are rendered again in rectangles of such tiles
constexpr float kSeenWhole = 0.999F;  // of alpha

struct Rectangle {
  int x = 0, y = 0, width = 0, height = 0;
};

// Rectangles that hold all pixels with a hole: rows of tiles, joined where they are alike.
std::vector<Rectangle> Holes(const ImageF& image) {
  const int columns = (image.width + kTilePx - 1) / kTilePx, rows = (image.height + kTilePx - 1) / kTilePx;
  std::vector<Rectangle> done, open;
  for (int row = 0; row < rows; ++row) {
    const int y0 = row * kTilePx, y1 = std::min(image.height, y0 + kTilePx);
    std::vector<bool> hole(static_cast<std::size_t>(columns) + 1, false);
    for (int y = y0; y < y1; ++y)
      for (int x = 0; x < image.width; ++x)
        if (image.At(x, y, 3) < kSeenWhole) hole[static_cast<std::size_t>(x / kTilePx)] = true;
    std::vector<Rectangle> now;
    for (int c = 0; c < columns; ++c) {
      if (!hole[static_cast<std::size_t>(c)]) continue;
      const int from = c;
      while (hole[static_cast<std::size_t>(c)]) ++c;
      now.push_back({from * kTilePx, y0, std::min(image.width, c * kTilePx) - from * kTilePx, y1 - y0});
    }
    for (Rectangle& r : now)
      for (Rectangle& above : open)
        if (above.x == r.x && above.width == r.width) {
          r.y = above.y;
          r.height += above.height;
          above.width = 0;
        }
    for (const Rectangle& above : open)
      if (above.width > 0) done.push_back(above);
    open = std::move(now);
  }
  done.insert(done.end(), open.begin(), open.end());
  return done;
}

class PerViewRenderer final : public Renderer {
 public:
  PerViewRenderer(const Scene& scene, const PerViewProxy& proxy, WorldRendererMaker make, int reach,
                  const BorderOptions& border)
      : scene_(scene), proxy_(proxy), make_(make), reach_(reach), border_(border), rank_of_view_(scene.views.size()) {
    for (int rank = 0; rank < proxy.order().count(); ++rank)
      rank_of_view_[static_cast<std::size_t>(proxy.order().view(rank))] = rank;
    const auto all = scene.views.size();
    const Eigen::Vector2i size = SizePx(scene, scene.views.front());
    const bool alike =
        std::all_of(scene.views.begin(), scene.views.end(), [&](const View& v) { return SizePx(scene, v) == size; });
    const int widest = border.fill ? std::max(reach, border.reach) : reach;
    photos_.resize(reach < 0 || !alike ? all : std::min(all, 2 * static_cast<std::size_t>(widest) + 1));
    places_.photos.assign(photos_.size(), -1);
    for (std::size_t place = 0; place < photos_.size(); ++place) {
      // Placeholder camera, until a picture has one for this place.
      RenderView v;
      v.size_px =
          alike ? size
                : SizePx(scene, scene.views[static_cast<std::size_t>(proxy.order().view(static_cast<int>(place)))]);
      v.P.leftCols<3>().setIdentity();
      places_.sources.views.push_back(v);
    }
  }

  ImageF Render(const RenderRequest& request) override {
    statistics_ = {};
    ImageF image = Picture(request, reach_, nullptr);
    statistics_.window_coverage = statistics_.wider_coverage = Coverage(image);
    if (!border_.fill) return image;
    for (int reach = reach_; reach >= 0 && reach < border_.reach && statistics_.wider_coverage < 1;) {
      reach = std::min(std::max(1, 2 * reach), border_.reach);
      Widen(request, reach, image);
      statistics_.wider_coverage = Coverage(image);
    }
    return image;
  }

  std::string Device() const override { return renderer_ ? renderer_->Device() : std::string(); }
  RenderStatistics Statistics() const override { return statistics_; }

 private:
  // `parts`: render only these pixels; nullptr: all.
  ImageF Picture(const RenderRequest& request, int reach, const std::vector<Rectangle>* parts) {
    const Stopwatch watch;
    RenderRequest own = request;
    own.view = Enter(proxy_.For(request.view, reach), request.use);
    own.use.clear();
    statistics_.plan_ms += 1000 * watch.Seconds();
    const auto render = [&] {
      ImageF picture = renderer_->Render(own);
      const RenderStatistics s = renderer_->Statistics();
      statistics_.plan_ms += s.plan_ms;
      statistics_.blend_ms += s.blend_ms;
      statistics_.samples += s.samples;
      statistics_.triangles += s.triangles;
      statistics_.optimum += s.optimum;
      return picture;
    };
    if (!parts) return render();
    ImageF image(request.view.size_px.x(), request.view.size_px.y(), 4);
    own.settings.grid_columns = own.settings.grid_rows = 0;  // sparse samples are meant for whole pictures
    const Matrix34d P = own.view.P;
    for (const Rectangle& r : *parts) {
      // The same rays, of fewer pixels.
      Eigen::Matrix3d part_from_picture = Eigen::Matrix3d::Identity();
      part_from_picture(0, 2) = -r.x;
      part_from_picture(1, 2) = -r.y;
      own.view.P = part_from_picture * P;
      own.view.size_px = {r.width, r.height};
      const ImageF part = render();
      for (int y = 0; y < r.height; ++y)
        std::copy_n(part.Row(y), 4 * static_cast<std::size_t>(r.width), image.Row(r.y + y) + 4 * r.x);
    }
    return image;
  }

  // Fills missing alpha from photos farther away in time.
  void Widen(const RenderRequest& request, int reach, ImageF& image) {
    const std::vector<Rectangle> holes = Holes(image);
    if (holes.empty()) return;
    const ImageF wider = Picture(request, reach, &holes);
    for (std::size_t i = 0; i < image.data.size(); i += 4) {
      const float missing = 1 - image.data[i + 3];
      if (missing > 0)
        for (std::size_t c = 0; c < 4; ++c) image.data[i + c] += missing * wider.data[i + c];
    }
  }

  // Puts the picture's cameras at their photos' places in photos_, and reads missing photos. Returns the picture's
  // view.
  RenderView Enter(PictureWorld picture, const std::vector<bool>& use) {
    PictureWorld world = places_;
    world.sources.normalized_from_world = picture.sources.normalized_from_world;
    world.use.assign(photos_.size(), false);
    std::vector<std::size_t> absent;
    for (std::size_t i = 0; i < picture.photos.size(); ++i) {
      const auto view = static_cast<std::size_t>(picture.photos[i]);
      if (!picture.use[i] || (!use.empty() && !use[view])) continue;
      const std::size_t place = Place(view);
      world.use[place] = true;
      world.sources.views[place] = picture.sources.views[i];
      if (places_.photos[place] != picture.photos[i]) absent.push_back(view);
    }
    ParallelFor(absent.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        photos_[Place(absent[i])] = LoadPhoto(scene_, {static_cast<std::int32_t>(absent[i])}, {});
    });
    for (const std::size_t view : absent) places_.photos[Place(view)] = static_cast<std::int32_t>(view);
    world.photos = places_.photos;
    world.view = picture.view;
    world.proxy = std::move(picture.proxy);
    auto shared = std::make_shared<const PictureWorld>(std::move(world));
    if (renderer_)
      renderer_->Enter(shared);
    else
      renderer_ = make_(shared, photos_, {});
    return shared->view;
  }

  std::size_t Place(std::size_t view) const { return static_cast<std::size_t>(rank_of_view_[view]) % photos_.size(); }

  const Scene& scene_;
  const PerViewProxy& proxy_;
  const WorldRendererMaker make_;
  const int reach_;
  const BorderOptions border_;
  std::vector<int> rank_of_view_;
  std::vector<Photo> photos_;  // a ring over their order in time
  // For each place: a placeholder camera, and the view whose photo is there (-1: none).
  PictureWorld places_;
  std::unique_ptr<WorldRenderer> renderer_;
  RenderStatistics statistics_;
};

}  // namespace

std::unique_ptr<Renderer> MakePerViewRenderer(const Scene& scene, const PerViewProxy& proxy, WorldRendererMaker make,
                                              int reach, const BorderOptions& border) {
  return std::make_unique<PerViewRenderer>(scene, proxy, make, reach, border);
}

}  // namespace lumi
