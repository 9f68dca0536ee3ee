#include <fmt/format.h>

#include <algorithm>

#include "proxy/commands.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/make_proxy.h"
#include "proxy/moving/moving_proxy.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

// The photo, its exposure taken out, and its mask, as large as asked for.
MovingPhoto ReadMovingPhoto(const Scene& scene, const MomentView& moment, int longer_px) {
  const View& view = scene.views[static_cast<std::size_t>(moment.view.value)];
  Camera camera = scene.CameraOf(view);
  const int longer = std::max(camera.width_px, camera.height_px);
  if (longer > longer_px) {
    const auto scaled = [&](int size) {
      return std::max(2, static_cast<int>(std::lround(static_cast<double>(size) * longer_px / longer)));
    };
    camera = camera.Scaled(scaled(camera.width_px), scaled(camera.height_px));
  }
  MovingPhoto photo;
  photo.render = MakeRenderView(camera, view.cam_from_world);
  photo.moment = moment.moment;
  photo.photo = Resize(ReadImage8(scene.ImagePath(view), 3), camera.width_px, camera.height_px);
  if (view.gain > 0 && view.gain != 1)
    for (std::uint8_t& value : photo.photo.data)
      value = static_cast<std::uint8_t>(std::clamp(std::lround(value / view.gain), 0L, 255L));
  photo.moves = Image8(camera.width_px, camera.height_px, 1);
  const std::filesystem::path file = FindMask(scene.folder / "masks", view.name);
  if (file.empty()) return photo;
  const Image8 mask = Resize(ReadImage8(file, 3), camera.width_px, camera.height_px);
  for (std::size_t p = 0; p < photo.moves.data.size(); ++p)
    photo.moves.data[p] = static_cast<std::uint8_t>(255 - mask.data[3 * p]);
  return photo;
}

// As it is recorded what the photos' times were.
std::string TimesOf(const Scene& scene) {
  std::size_t count = 0;
  double sum = 0, squares = 0;
  for (const View& v : scene.views)
    if (v.time_s) ++count, sum += *v.time_s, squares += *v.time_s * *v.time_s;
  return fmt::format("{} {:.17g} {:.17g} {:.17g}", count, sum, squares, scene.period_s.value_or(0));
}

}  // namespace

std::string UnfitForMoving(const Scene& scene) {
  std::error_code error;
  if (!std::filesystem::exists(scene.folder / "masks", error)) return "nothing is masked";
  if (PickMoments(scene, {}).empty()) return "no two photos show one moment from different places";
  return {};
}

Made<MovingFigures> RunMoving(const ProxyTarget& target, const MovingRequest& request, ProgressSink& progress) {
  const MovingOptions& options = request.moving;
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  const Scene opened = OpenForProxy(target.scene, progress);
  if (const std::string unfit = UnfitForMoving(opened); !unfit.empty())
    throw DataError(unfit, "lumi-timeperiodic calibrate masks what moves and gives the photos their times",
                    opened.folder);
  const std::vector<std::string> there = ListProxies(opened.folder);
  const bool made = std::ranges::find(there, request.over) == there.end();
  if (made && request.over != MovingRequest().over) LoadProxy(opened, request.over);  // says which there are
  std::map<std::string, std::string> inputs{{"masks", Fingerprint(opened.folder / "masks")},
                                            {"images", Fingerprint(opened.image_folder)},
                                            {"times", TimesOf(opened)}};
  if (!made) inputs["over"] = Fingerprint(ProxyPath(opened.folder, request.over));
  std::map<std::string, std::string> record{{"over", request.over},
                                            {"moments", std::to_string(options.moments)},
                                            {"grid", std::to_string(options.grid)},
                                            {"smoothness", fmt::format("{}", options.smoothness)}};
  return MakeAndKeep<MovingFigures>(target, "moving", std::move(record), std::move(inputs), progress,
                                    [&](const Scene& scene, MovingFigures& figures) {
                                      const Mesh still = made ? BuildDelaunayProxy(scene, {}, progress)
                                                              : LoadProxy(scene, request.over);
                                      const std::vector<MomentView> moments = PickMoments(scene, options);
                                      std::vector<MovingPhoto> photos(moments.size());
                                      {
                                        Progress reading(progress, "reading photos", static_cast<long>(photos.size()));
                                        ParallelEach(photos.size(), 4, [&](std::size_t i) {
                                          photos[i] = ReadMovingPhoto(scene, moments[i], options.photo_px);
                                          reading.Step();
                                        });
                                      }
                                      figures.over = request.over;
                                      return BuildMovingProxy(photos, still, options, progress, &figures.surface);
                                    });
}

}  // namespace lumi
