#include <algorithm>
#include <chrono>
#include <cmath>

#include "render/picture/border_fill.h"
#include "render/picture/convert.h"
#include "render/world/per_view_proxy.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kTilePx = 32;             // what is looked at once more comes in rectangles of these
constexpr float kSeenWhole = 0.999F;    // of alpha

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

class Implementation final : public PerViewRenderer {
 public:
  Implementation(const Scene& scene, const PerViewProxy& proxy, RendererMaker make, int reach, const BorderOptions& border)
      : scene_(scene), proxy_(proxy), make_(make), reach_(reach), border_(border) {}

  ImageF Render(const RenderRequest& request) override {
    statistics_ = {};
    coverage_ = {};
    ImageF image = Picture(request, reach_, nullptr);
    coverage_.window = coverage_.wider = lumi::Coverage(image);
    if (!border_.fill) return image;
    for (int reach = reach_; reach >= 0 && reach < border_.reach && coverage_.wider < 1;) {
      reach = std::min(std::max(1, 2 * reach), border_.reach);
      Widen(request, reach, image);
      coverage_.wider = lumi::Coverage(image);
    }
    if (request.show == Show::kColor) FillSmoothly(image);
    return image;
  }

  void SetReach(int reach) override { reach_ = reach; }
  PictureCoverage Coverage() const override { return coverage_; }
  void ReplaceProxy(const Mesh&) override {}            // each picture has its own
  void ReplaceCameras(const Sources&) override {}
  void PhotoReplaced(ViewId, int) override {}
  std::string Device() const override { return renderer_ ? renderer_->Device() : std::string(); }
  RenderStatistics Statistics() const override { return statistics_; }

 private:
  using Clock = std::chrono::steady_clock;
  static double Milliseconds(Clock::time_point since) { return std::chrono::duration<double, std::milli>(Clock::now() - since).count(); }

  // `parts`: these pixels alone.
  ImageF Picture(const RenderRequest& request, int reach, const std::vector<Rectangle>* parts) {
    const auto start = Clock::now();
    const PictureWorld world = proxy_.For(request.view, reach);
    Reserve(reach);
    RenderRequest own = request;
    own.view = world.view;
    own.use.assign(photos_.size(), false);
    std::vector<std::size_t> absent;
    Sources cameras = cameras_;
    cameras.normalized_from_world = world.sources.normalized_from_world;
    for (std::size_t i = 0; i < world.photos.size(); ++i) {
      const auto view = static_cast<std::size_t>(world.photos[i]);
      if (!world.use[i] || (!request.use.empty() && !request.use[view])) continue;
      const std::size_t place = Place(view);
      own.use[place] = true;
      cameras.views[place] = world.sources.views[i];
      if (shown_[place] != world.photos[i]) absent.push_back(view);
    }
    Load(absent);
    renderer_->ReplaceCameras(cameras);
    mesh_ = world.proxy;
    renderer_->ReplaceProxy(mesh_);
    statistics_.plan_ms += Milliseconds(start);
    const auto add = [&] {
      const RenderStatistics s = renderer_->Statistics();
      statistics_.plan_ms += s.plan_ms;
      statistics_.blend_ms += s.blend_ms;
      statistics_.samples += s.samples;
      statistics_.triangles += s.triangles;
      statistics_.optimum += s.optimum;
    };
    if (!parts) {
      ImageF image = renderer_->Render(own);
      add();
      return image;
    }
    ImageF image(request.view.size_px.x(), request.view.size_px.y(), 4);
    own.settings.grid_columns = own.settings.grid_rows = 0;  // samples are laid over whole pictures
    for (const Rectangle& r : *parts) {
      // The same rays, of fewer pixels.
      Eigen::Matrix3d part_from_picture = Eigen::Matrix3d::Identity();
      part_from_picture(0, 2) = -r.x;
      part_from_picture(1, 2) = -r.y;
      own.view.P = part_from_picture * world.view.P;
      own.view.size_px = {r.width, r.height};
      const ImageF part = renderer_->Render(own);
      add();
      for (int y = 0; y < r.height; ++y) std::copy_n(part.Row(y), 4 * static_cast<std::size_t>(r.width), image.Row(r.y + y) + 4 * r.x);
    }
    return image;
  }

  // What is missing, from photos farther away in time.
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

  std::size_t Place(std::size_t view) const { return static_cast<std::size_t>(rank_of_view_[view]) % photos_.size(); }

  // Places for all photos that a picture of this reach may want.
  void Reserve(int reach) {
    const auto all = scene_.views.size();
    if (rank_of_view_.empty()) {
      rank_of_view_.resize(all);
      for (int rank = 0; rank < proxy_.order().count(); ++rank) rank_of_view_[static_cast<std::size_t>(proxy_.order().view(rank))] = rank;
    }
    const Eigen::Vector2i size = SizePx(scene_, scene_.views.front());
    const bool alike = std::all_of(scene_.views.begin(), scene_.views.end(), [&](const View& v) { return SizePx(scene_, v) == size; });
    const std::size_t wanted = reach < 0 || !alike ? all : std::min(all, 2 * static_cast<std::size_t>(std::max({reach, reach_, border_.fill ? border_.reach : 0})) + 1);
    if (renderer_ && wanted <= photos_.size()) return;
    renderer_.reset();
    photos_.assign(wanted, {});
    shown_.assign(wanted, -1);
    // Stand-ins, until a picture's own cameras come.
    places_ = {};
    places_.frame = Frame::kQuasiAffine;
    for (std::size_t place = 0; place < wanted; ++place) {
      View v;
      v.size_px = SizePx(scene_, scene_.views[wanted == all ? static_cast<std::size_t>(proxy_.order().view(static_cast<int>(place))) : 0]);
      v.P.leftCols<3>().setIdentity();
      places_.views.push_back(v);
    }
    cameras_ = MakeSources(places_);
    mesh_ = {};
    renderer_ = make_(places_, mesh_, photos_);
  }

  void Load(const std::vector<std::size_t>& views) {
    ParallelFor(views.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) photos_[Place(views[i])] = LoadPhoto(scene_, {static_cast<std::int32_t>(views[i])}, {});
    });
    for (const std::size_t view : views) {
      const std::size_t place = Place(view);
      shown_[place] = static_cast<int>(view);
      renderer_->PhotoReplaced({static_cast<std::int32_t>(place)}, static_cast<int>(view));
    }
  }

  const Scene& scene_;
  const PerViewProxy& proxy_;
  const RendererMaker make_;
  int reach_;
  const BorderOptions border_;
  std::vector<int> rank_of_view_;
  Scene places_;                   // the photos' places: a ring over their order in time
  Sources cameras_;
  std::vector<Photo> photos_;
  std::vector<int> shown_;         // the view whose photo is there, -1: none
  std::unique_ptr<Renderer> renderer_;
  Mesh mesh_;
  RenderStatistics statistics_;
  PictureCoverage coverage_;
};

}  // namespace

std::unique_ptr<PerViewRenderer> MakePerViewRenderer(const Scene& scene, const PerViewProxy& proxy, RendererMaker make, int reach,
                                                     const BorderOptions& border) {
  return std::make_unique<Implementation>(scene, proxy, make, reach, border);
}

}  // namespace lumi
