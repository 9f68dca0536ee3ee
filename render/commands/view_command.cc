// lumi-render --view: a photo's own camera.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "render/commands/render_job.h"
#include "render/picture/border_fill.h"
#include "render/picture/convert.h"
#include "render/picture/output_name.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// Mean absolute difference (code values) over the pixels where anything is seen: is a photo given back at its camera?
double SeenDifference(const ImageF& image, const Image8& photo) {
  double sum = 0, n = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float alpha = image.At(x, y, 3);
      if (!(alpha > 0)) continue;
      for (int c = 0; c < 3; ++c) sum += std::abs(255.0 * image.At(x, y, c) / alpha - photo.At(x, y, c));
      n += 3;
    }
  return n > 0 ? sum / n : 0;
}

AskedPixel Asked(const Scene& scene, const Eigen::Vector2d& x_px, const WeightsAtRays& at, std::size_t i) {
  AskedPixel pixel;
  pixel.x_px = x_px;
  pixel.alpha = at.table.alpha[i];
  if (std::isfinite(at.point[3 * i])) pixel.point.assign(at.point.data() + 3 * i, at.point.data() + 3 * i + 3);
  for (std::int32_t e = at.table.first[i]; e < at.table.first[i + 1]; ++e) {
    const std::int32_t view = at.table.camera[static_cast<std::size_t>(e)];
    pixel.photos.push_back({scene.views[static_cast<std::size_t>(view)].name, FalseColorOf(view),
                            static_cast<double>(at.table.weight[static_cast<std::size_t>(e)])});
  }
  std::ranges::stable_sort(pixel.photos, std::greater<>(), &PixelPhoto::weight);
  return pixel;
}

// --pixel, and the legend of false colours, which goes beside the picture.
void TellPhotos(const RenderJob& job, const RenderRequest& request, const std::filesystem::path& stem,
                ViewFigures& figures) {
  const bool false_color = job.options.show == "false-color";
  if (!false_color && job.options.pixels.empty()) return;
  const Scene& scene = job.scene();
  const Eigen::Vector2i& size = request.view.size_px;
  for (const Eigen::Vector2d& x : job.options.pixels)
    if (!(x.x() >= 0 && x.x() <= size.x() && x.y() >= 0 && x.y() <= size.y()))
      throw UsageError(
          fmt::format("--pixel {:g},{:g} lies outside the picture of {}x{} pixels", x.x(), x.y(), size.x(), size.y()));
  const ViewWeights weights(job.lumigraph, request.view, request.use, request.settings);
  if (false_color) {
    figures.legend = LegendOf(scene, weights);
    WriteTextAtomically(stem.string() + "_legend.svg", LegendSvg(figures.legend));
  }
  const WeightsAtRays at = weights.At(job.options.pixels);
  for (std::size_t i = 0; i < job.options.pixels.size(); ++i)
    figures.pixels.push_back(Asked(scene, job.options.pixels[i], at, i));
}

}  // namespace

DesiredViews ViewWanted(const RenderJob& job) {
  const RenderOptions& o = job.options;
  const auto id = static_cast<std::size_t>(ViewCalled(job.scene(), o.view));
  const View& view = job.scene().views[id];
  DesiredViews wanted{{PhotosView(job.scene(), view, SizeAskedFor(o, SizePx(job.scene(), view)))}, {}};
  if (o.leave_out) {
    wanted.use.assign(job.scene().views.size(), true);
    wanted.use[id] = false;
  }
  return wanted;
}

void RenderOneView(RenderJob& job) {
  const RenderOptions& o = job.options;
  const View& view = job.scene().views[static_cast<std::size_t>(ViewCalled(job.scene(), o.view))];
  RenderRequest request = job.Request(job.wanted.views.front());
  request.use = job.wanted.use;
  const auto start = std::chrono::steady_clock::now();
  ImageF image = job.Picture(request);
  job.summary.ms_per_frame = 1000 * SecondsSince(start);
  job.summary.frames = 1;
  job.summary.coverage = Coverage(image);
  ViewFigures& figures = job.summary.views.emplace_back();
  figures.name = view.name;
  figures.left_out = o.leave_out;
  figures.coverage = *job.summary.coverage;
  if (request.settings.time) figures.time_s = request.settings.time_s;
  Image8 photo, rendered;
  // Heat maps and false colours cannot be compared with the photo.
  if (o.show == "color" || o.show == "difference") {
    photo = Resize(ReadImage8(job.scene().ImagePath(view), 3), image.width, image.height);
    rendered = ToRgb8(image);
    const ImageDifference d = Compare(rendered, photo);
    figures.psnr_db = d.psnr_db;
    figures.ssim = d.ssim;
    figures.mean_absolute_difference = d.mean_absolute;
    figures.mean_absolute_difference_seen = SeenDifference(image, photo);
  }
  // Pictures of other kinds stand beside the colours.
  const std::filesystem::path stem =
      o.output / (OutputName(job.scene().views, view.name) + (o.show == "color" ? "" : "_" + o.show));
  TellPhotos(job, request, stem, figures);
  std::string file = stem.string() + "." + o.format;
  if (o.show == "cameras" || o.show == "difference")
    WriteImage(file = stem.string() + (o.format == "jpg" ? ".jpg" : ".png"),
               o.show == "cameras" ? job.CamerasAround(request.view) : DifferenceImage(rendered, photo));
  else {
    // Holes are filled only in the file: the figures above are of what photos saw.
    if (job.Fills()) FillAndMark(image);
    job.Write(stem, image);
  }
  job.summary.wrote = file;
}

}  // namespace lumi
