#include "proxy/silhouettes/silhouette_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "proxy/silhouettes/colour_rule.h"
#include "proxy/silhouettes/grab_cut.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/taken_photos.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

void RequireSize(const Image8& image, const Eigen::Vector2i& size_px, const fs::path& file, const char* what) {
  if (image.width == size_px.x() && image.height == size_px.y()) return;
  throw InputError(file,
                   fmt::format("is {}x{} pixels, the photo {}x{}", image.width, image.height, size_px.x(), size_px.y()),
                   fmt::format("{} has to have its photo's size", what));
}

}  // namespace

std::vector<SilhouetteView> ReadSilhouettes(const Scene& scene, const fs::path& folder, const CleanOptions& clean,
                                            std::vector<std::string>* without, ProgressSink& progress) {
  if (const std::string wrong = Validate(clean); !wrong.empty()) throw UsageError(wrong);
  std::vector<SilhouetteView> views;
  std::vector<fs::path> files;
  for (const View& view : scene.views) {
    const fs::path file = FindMask(folder, view.name);
    if (file.empty()) {
      if (without != nullptr) without->push_back(view.name);
      continue;
    }
    files.push_back(file);
    views.push_back({view.name, MakeRenderView(scene, view).P, {}});
    views.back().mask = Image8(SizePx(scene, view).x(), SizePx(scene, view).y(), 1);
  }
  if (views.empty()) {
    throw DataError("there are no silhouettes in " + folder.string(),
                    "make them: lumi-proxy silhouettes SCENE --rule ..., or give --silhouettes DIR");
  }
  Progress steps(progress, "reading silhouettes", static_cast<long>(views.size()));
  ParallelEach(views.size(), 1, [&](std::size_t v) {
    const Image8 mask = ReadImage8(files[v], 3);
    RequireSize(mask, {views[v].mask.width, views[v].mask.height}, files[v], "a silhouette");
    views[v].mask = Clean(SilhouetteFromMask(mask), clean);
    steps.Step();
  });
  return views;
}

std::string Validate(const SilhouetteSource& s) {
  const int given = (s.rule.empty() ? 0 : 1) + (s.background.empty() ? 0 : 1) + (s.colour ? 1 : 0) +
                    (s.border_colour ? 1 : 0) + (s.alpha ? 1 : 0) + (s.masks.empty() ? 0 : 1) + (s.box_px ? 1 : 0);
  if (given != 1)
    return "silhouettes come from one of --rule, --background, --background-colour, --background-border, --alpha, "
           "--masks, --box";
  if (s.undistort && s.masks.empty() && s.background.empty()) return "--undistort goes with --masks and --background";
  if (!(s.threshold >= 0) || !(s.threshold <= 442)) return "the threshold must be between 0 and 442";
  return {};
}

std::vector<FoundSilhouette> MakeSilhouettes(const Scene& scene, const SilhouetteSource& source,
                                             const CleanOptions& clean, const fs::path& folder,
                                             ProgressSink& progress) {
  for (const std::string& wrong : {Validate(source), Validate(clean)})
    if (!wrong.empty()) throw UsageError(wrong);
  std::optional<ColourRule> rule;
  if (!source.rule.empty()) rule.emplace(source.rule);
  std::error_code error;
  const bool one_background = !source.background.empty() && !fs::is_directory(source.background, error);
  const Image8 background = one_background ? ReadImage8(source.background, 3) : Image8();
  std::optional<TakenToScene> taken;
  if (source.undistort) taken.emplace(scene);
  // Of the files that belong to a photo.
  const auto name_of = [&](const View& view) { return taken ? taken->Name(view) : view.name; };
  const auto size_of = [&](const View& view) { return taken ? taken->SizePx(view) : SizePx(scene, view); };
  const auto mask_of = [&](const View& view) {
    const fs::path file = FindMask(source.masks, name_of(view));
    return file.empty() ? FindMask(source.masks, view.name) : file;
  };
  if (!source.masks.empty() && !scene.views.empty() &&
      std::ranges::all_of(scene.views, [&](const View& v) { return mask_of(v).empty(); }))
    throw DataError(fmt::format("none of the {} photos has a mask in {}", scene.views.size(), source.masks.string()),
                    fmt::format("the mask of {0} is looked for as {0}.png, white = object", name_of(scene.views[0])));
  const auto find = [&](const View& view) -> Image8 {
    const Eigen::Vector2i size_px = SizePx(scene, view);
    if (!source.masks.empty()) {
      const fs::path file = mask_of(view);
      if (file.empty()) return Image8(size_px.x(), size_px.y(), 1);
      const Image8 mask = ReadImage8(file, 3);
      RequireSize(mask, size_of(view), file, "a mask");
      Image8 silhouette = SilhouetteFromMask(mask);
      return taken ? taken->Mask(view, std::move(silhouette)) : silhouette;
    }
    const fs::path path = scene.ImagePath(view);
    const Image8 photo = ReadImage8(path, source.alpha ? 4 : 3);
    RequireSize(photo, size_px, path, "the camera");
    if (source.alpha) {
      if (!HasAlpha(photo))
        throw DataError(path.string() + " has no transparent pixel",
                        "--rule or --box finds silhouettes in opaque photos");
      return SilhouetteFromAlpha(photo);
    }
    if (rule) return SilhouetteFromRule(photo, *rule);
    if (source.box_px) return SilhouetteFromBox(photo, *source.box_px);
    if (source.border_colour) return SilhouetteFromBackground(photo, BorderColour(photo), source.threshold);
    if (source.colour)
      return SilhouetteFromBackground(
          photo, std::array<double, 3>{source.colour->x(), source.colour->y(), source.colour->z()}, source.threshold);
    fs::path file = one_background ? source.background : source.background / name_of(view);
    if (std::error_code none; !fs::exists(file, none)) file = source.background / view.name;
    const Image8 other = one_background ? Image8() : ReadImage8(file, 3);
    const Image8& behind = one_background ? background : other;
    RequireSize(behind, size_of(view), file, "a background");
    return SilhouetteFromBackground(photo, taken ? taken->Photo(view, behind) : behind, source.threshold);
  };
  std::vector<FoundSilhouette> found(scene.views.size());
  std::vector<Image8> pictures(scene.views.size());
  Progress steps(progress, "finding silhouettes", static_cast<long>(scene.views.size()));
  const auto work = [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      pictures[v] = Clean(find(scene.views[v]), clean);
      found[v] = {scene.views[v].name, Describe(pictures[v]), !source.masks.empty() && mask_of(scene.views[v]).empty()};
      CheckInterrupted();
      steps.Step();
    }
  };
  // One photo after the other: GrabCut draws from one sequence of random numbers.
  if (source.box_px)
    work(0, scene.views.size());
  else
    ParallelFor(scene.views.size(), 1, work);
  bool any = false;
  for (const FoundSilhouette& f : found)
    any = any || (f.info.kind != SilhouetteKind::kEmpty && f.info.kind != SilhouetteKind::kFull);
  if (!any)
    throw DataError("every silhouette is empty or fills its photo", "look at the rule, the background or the masks");
  for (std::size_t v = 0; v < pictures.size(); ++v) WriteImage(folder / (found[v].name + ".png"), pictures[v]);
  return found;
}

bool MayBeDistorted(const Scene& scene, const fs::path& folder) {
  const fs::path within =
      fs::absolute(folder).lexically_normal().lexically_relative(fs::absolute(scene.folder).lexically_normal());
  if (!within.empty() && *within.begin() != "..") return false;
  return std::ranges::any_of(ReadTakenPhotos(scene.image_folder),
                             [](const TakenPhoto& photo) { return !photo.camera.IsPinhole(); });
}

}  // namespace lumi
