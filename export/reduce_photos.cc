#include "export/reduce_photos.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "export/plain_jpeg.h"
#include "render/cpu/pixels.h"
#include "render/picture/convert.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/image_difference/image_difference.h"
#include "scene/model/photo_twins.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kFold = 8;             // as lumi-render --holdout 8
constexpr std::size_t kJudges = 4;   // photos that a reduction is judged by, at most
constexpr std::size_t kSamples = 6;  // photos whose JPEGs tell how large all will be
constexpr double kMuchMore = 1.1;    // than they told: other reductions fit than those that seemed to
constexpr double kScales[] = {1, 0.75, 0.5, 0.375, 0.25};
// Of photos whose longer side then has at least kLeastLongestPx.
constexpr double kFinerScales[] = {0.1875, 0.125, 0.09375, 0.0625};
constexpr double kLeastLongestPx = 640;
// Longer side of the pictures that reductions are judged by, at most.
constexpr int kMostJudgedPx = 3200;
constexpr int kQualities[] = {kAsTheyAre, kBestCoded, 92, 85, 75, 60, 45};
// Largest mean difference of code values between two decoders of one JPEG. Beyond it, the photo was rotated, corrected
// or converted to sRGB when it was read.
constexpr double kSameCodes = 1;
// Of a coarser JPEG, or a smaller photo, nothing is expected that fewer photos do not do better.
constexpr int kMostEvery = 4;
constexpr std::size_t kLeastKept = 8;  // photos
// How many of the reductions that fit are rendered: those with the most bytes.
constexpr std::size_t kMostTried = 6;

Eigen::Vector2i Scaled(const Eigen::Vector2i& size, double scale) {
  return (size.cast<double>() * scale).array().round().cast<int>().max(1);
}

const Photo& PhotoOfView(const Lumigraph& lumigraph, int view) {
  return lumigraph.photos()[static_cast<std::size_t>(view)];
}
const Image8& Pixels(const Lumigraph& lumigraph, int view) { return PhotoOfView(lumigraph, view).levels.front(); }

// Of the photos' full size: none is larger than they are in memory.
std::vector<double> ScalesOf(const Lumigraph& lumigraph) {
  int longest = 1, halvings = 0;
  for (const View& view : lumigraph.scene().views)
    longest = std::max(longest, SizePx(lumigraph.scene(), view).maxCoeff());
  for (const Photo& photo : lumigraph.photos()) halvings = std::max(halvings, photo.level0_shift);
  const double most = std::ldexp(1.0, -halvings);
  std::vector<double> scales;
  for (const double scale : kScales)
    if (scale <= most) scales.push_back(scale);
  for (const double scale : kFinerScales)
    if (scale <= most && longest * scale >= kLeastLongestPx) scales.push_back(scale);
  if (scales.empty()) scales.push_back(most);
  return scales;
}

std::vector<int> Kept(const Scene& scene, int every) {
  std::vector<int> kept;
  for (int i = 0; i < static_cast<int>(scene.views.size()); i += every) kept.push_back(i);
  return kept;
}

// The file as it is, where it is a JPEG whose pixels are the photo's.
std::optional<std::string> OwnJpeg(const Scene& scene, int view, const Image8& photo) {
  const std::optional<std::string> plain =
      PlainJpeg(ReadText(scene.ImagePath(scene.views[static_cast<std::size_t>(view)])));
  if (!plain) return std::nullopt;
  Image8 decoded;
  try {
    decoded = DecodeJpeg(*plain);
  } catch (const std::exception&) {  // a kind of JPEG that this decoder, or a browser's, does not know
    return std::nullopt;
  }
  if (decoded.width != photo.width || decoded.height != photo.height || decoded.data.size() != photo.data.size())
    return std::nullopt;
  double sum = 0;
  for (std::size_t i = 0; i < decoded.data.size(); ++i) sum += std::abs(decoded.data[i] - photo.data[i]);
  if (sum > kSameCodes * static_cast<double>(decoded.data.size())) return std::nullopt;
  return plain;
}

PagePhoto PhotoOf(const Lumigraph& lumigraph, int view, const Eigen::Vector2i& size, int quality) {
  const Image8& photo = Pixels(lumigraph, view);
  if (quality == kAsTheyAre && size == Eigen::Vector2i(photo.width, photo.height))
    if (std::optional<std::string> own = OwnJpeg(lumigraph.scene(), view, photo)) return {std::move(*own), true, size};
  return {EncodeJpeg(Resize(photo, size.x(), size.y()), quality == kAsTheyAre ? kBestCoded : quality), false, size};
}

// JPEG bytes of all photos that a reduction keeps, estimated from about kSamples of them.
double BytesOf(const Lumigraph& lumigraph, const PhotoReduction& r) {
  const std::vector<int> kept = Kept(lumigraph.scene(), r.every);
  const std::size_t step = std::max<std::size_t>(1, kept.size() / kSamples);
  std::vector<int> samples;
  for (std::size_t i = step / 2; i < kept.size(); i += step) samples.push_back(kept[i]);
  std::vector<std::size_t> bytes(samples.size());
  ParallelFor(samples.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const Scene& scene = lumigraph.scene();
      const Eigen::Vector2i size = Scaled(SizePx(scene, scene.views[static_cast<std::size_t>(samples[n])]), r.scale);
      bytes[n] = PhotoOf(lumigraph, samples[n], size, r.quality).jpeg.size();
    }
  });
  const std::size_t all = std::accumulate(bytes.begin(), bytes.end(), std::size_t{0});
  return static_cast<double>(all) / static_cast<double>(samples.size()) * static_cast<double>(kept.size());
}

// To the next lower quality; false where there is none.
bool Coarsen(PhotoReduction& r) {
  const auto next = std::next(std::ranges::find(kQualities, r.quality));
  if (next == std::end(kQualities)) return false;
  r.quality = *next;
  return true;
}

std::size_t BytesOf(const ReducedPhotos& reduced) {
  std::size_t bytes = 0;
  for (const PagePhoto& photo : reduced.photos) bytes += photo.jpeg.size();
  return bytes;
}

// Mean PSNR of the held-out photos (at most kJudges), over the pixels that are seen.
double HeldOutDb(const Lumigraph& lumigraph, const ReducedPhotos& reduced) {
  const Scene& whole = lumigraph.scene();
  std::vector<Photo> photos(reduced.photos.size());
  ParallelFor(photos.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) photos[i].levels = BuildPyramid(DecodeJpeg(reduced.photos[i].jpeg));
  });
  const auto renderer = MakeCpuRenderer(WorldOf(reduced.scene, lumigraph.mesh()), photos);
  std::vector<ViewId> judges = FoldViews(whole, kFold, Fold::kChoose);
  if (judges.empty()) judges = {{static_cast<std::int32_t>(whole.views.size() / 2)}};
  if (judges.size() > kJudges) {
    std::vector<ViewId> some;
    for (std::size_t i = 0; i < kJudges; ++i) some.push_back(judges[i * judges.size() / kJudges]);
    judges = some;
  }
  double db = 0;
  const PhotoTwins twins(whole);
  for (const ViewId judge : judges) {
    const View& view = whole.views[static_cast<std::size_t>(judge.value)];
    const auto& levels = PhotoOfView(lumigraph, judge.value).levels;
    const auto small_enough = [](const Image8& level) { return std::max(level.width, level.height) <= kMostJudgedPx; };
    const Image8& photo = *std::ranges::find_if(levels, small_enough);  // the last level is a pixel
    RenderRequest request;
    request.view = MakeRenderView(whole, view);
    const RenderView scaled =
        MakeRenderView(whole.CameraOf(view).Scaled(photo.width, photo.height), view.cam_from_world);
    request.view.P = scaled.P;
    request.view.size_px = scaled.size_px;
    request.settings = lumigraph.At(request.view);
    request.use.assign(photos.size(), true);
    std::vector<bool> others(whole.views.size(), true);
    others[static_cast<std::size_t>(judge.value)] = false;
    twins.LeaveOut(others);
    for (std::size_t i = 0; i < photos.size(); ++i) request.use[i] = others[static_cast<std::size_t>(reduced.view[i])];
    const ImageF picture = renderer->Render(request);
    const Image8 rendered = ToRgb8(picture);
    Image8 seen(picture.width, picture.height, 1);
    for (int y = 0; y < seen.height; ++y)
      for (int x = 0; x < seen.width; ++x) seen.At(x, y, 0) = picture.At(x, y, 3) > 0.5F ? 255 : 0;
    db += PsnrWithin(rendered, photo, seen).value_or(0);
  }
  return db / static_cast<double>(judges.size());
}

}  // namespace

std::string EncodeJpeg(const Image8& image, int quality) {
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.data.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, quality, cv::IMWRITE_JPEG_OPTIMIZE, 1}))
    throw std::runtime_error("a photo cannot be encoded as JPEG");
  return {bytes.begin(), bytes.end()};
}

Image8 DecodeJpeg(const std::string& jpeg) {
  const std::vector<std::uint8_t> bytes(jpeg.begin(), jpeg.end());
  cv::Mat bgr = cv::imdecode(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  if (bgr.empty()) throw std::runtime_error("a JPEG that cannot be decoded");
  Image8 image(bgr.cols, bgr.rows, 3);
  cv::Mat rgb(image.height, image.width, CV_8UC3, image.data.data());
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return image;
}

double MostPixelsWithin(std::size_t photos, double max_bytes) {
  constexpr double kLeastBytesAPixel = 0.02;  // of a blurred photo's JPEG at the lowest quality
  int every = 1;
  while (every < kMostEvery && photos / static_cast<std::size_t>(every + 1) >= kLeastKept) ++every;
  return every * max_bytes / kLeastBytesAPixel;
}

ReducedPhotos Reduce(const Lumigraph& lumigraph, const PhotoReduction& reduction, ProgressSink& sink) {
  const Scene& whole = lumigraph.scene();
  ReducedPhotos reduced;
  reduced.reduction = reduction;
  reduced.view = Kept(whole, reduction.every);
  reduced.scene = whole;
  reduced.scene.views.clear();
  reduced.scene.cameras.clear();
  reduced.scene.points.clear();
  reduced.photos.resize(reduced.view.size());
  for (const int i : reduced.view) {
    View view = whole.views[static_cast<std::size_t>(i)];
    const Eigen::Vector2i size = Scaled(SizePx(whole, view), reduction.scale);
    reduced.scene.cameras.push_back(whole.CameraOf(view).Scaled(size.x(), size.y()));
    view.camera = {static_cast<std::int32_t>(reduced.scene.cameras.size()) - 1};
    reduced.scene.views.push_back(std::move(view));
  }
  Progress progress(sink, "encoding photos", static_cast<long>(reduced.view.size()));
  ParallelFor(reduced.view.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector2i size = SizePx(reduced.scene, reduced.scene.views[i]);
      reduced.photos[i] = PhotoOf(lumigraph, reduced.view[i], size, reduction.quality);
      progress.Step();
    }
  });
  reduced.reduction.own = static_cast<int>(std::ranges::count(reduced.photos, true, &PagePhoto::own));
  return reduced;
}

namespace {

// Of each number of photos and each size the best quality that fits by what a few photos tell, those with the most
// bytes first. Without `all`, none that only loses detail.
std::vector<PhotoReduction> Fitting(const Lumigraph& lumigraph, double max_bytes, int max_width_px, double bytes_a_byte,
                                    bool all) {
  int widest = 0;
  for (const View& view : lumigraph.scene().views) widest = std::max(widest, SizePx(lumigraph.scene(), view).x());
  const std::vector<double> scales = ScalesOf(lumigraph);
  std::vector<PhotoReduction> fitting;
  for (int every = 1; every <= kMostEvery; ++every) {
    if (every > 1 && lumigraph.scene().views.size() / static_cast<std::size_t>(every) < kLeastKept) break;
    for (double scale : scales) {
      if (max_width_px > 0) scale = std::min(scale, static_cast<double>(max_width_px) / widest);
      // The best quality that fits.
      for (const int quality : kQualities) {
        if (quality == kAsTheyAre && scale < 1) continue;
        PhotoReduction r{every, scale, quality};
        const double bytes = BytesOf(lumigraph, r) * bytes_a_byte;
        if (bytes > max_bytes) continue;
        r.mb = bytes / 1e6;
        if (fitting.empty() || fitting.back().every != every || fitting.back().scale != scale) fitting.push_back(r);
        break;
      }
      if (!fitting.empty() && fitting.back().every == every && fitting.back().scale == scale &&
          fitting.back().quality >= kBestCoded && !all)
        break;  // smaller versions of the same photos only lose detail
    }
    if (!fitting.empty() && fitting.back().every == every && fitting.back().scale >= scales.front() - 1e-9 &&
        fitting.back().quality >= kBestCoded && !all)
      break;  // all of them fit as large as they are held, with hardly any loss
  }
  std::ranges::stable_sort(fitting, std::greater(), &PhotoReduction::mb);
  return fitting;
}

// Reduces the photos, coarser than r says where they take more than their samples told. excess: by how much they took
// more so far. Nothing: not even at the lowest quality they fit.
std::optional<ReducedPhotos> ReduceWithin(const Lumigraph& lumigraph, PhotoReduction& r, double max_bytes,
                                          double bytes_a_byte, double& excess, ProgressSink& sink) {
  for (;;) {
    double told = BytesOf(lumigraph, r) * bytes_a_byte;
    while (told * excess > max_bytes && Coarsen(r)) told = BytesOf(lumigraph, r) * bytes_a_byte;
    ReducedPhotos reduced = Reduce(lumigraph, r, sink);
    const double bytes = static_cast<double>(BytesOf(reduced)) * bytes_a_byte;
    r.own = reduced.reduction.own;
    r.mb = bytes / 1e6;
    if (bytes <= max_bytes) return reduced;
    excess = std::max(excess, bytes / told);
    if (!Coarsen(r)) return std::nullopt;
  }
}

}  // namespace

ReducedPhotos ReduceFor(const Lumigraph& lumigraph, double max_bytes, int max_width_px, double bytes_a_byte,
                        std::vector<PhotoReduction>& tried, ProgressSink& sink) {
  std::vector<PhotoReduction> measured, failed;
  double excess = 1;
  const auto measure = [&](double within, bool all) {
    for (PhotoReduction& r : Fitting(lumigraph, within, max_width_px, bytes_a_byte, all)) {
      if (measured.size() == kMostTried) return;
      const auto same = [&](const PhotoReduction& other) { return other.every == r.every && other.scale == r.scale; };
      if (std::ranges::any_of(measured, same) || std::ranges::any_of(failed, same)) continue;
      const auto reduced = ReduceWithin(lumigraph, r, max_bytes, bytes_a_byte, excess, sink);
      if (reduced) r.psnr_db = HeldOutDb(lumigraph, *reduced);
      (reduced ? measured : failed).push_back(r);
    }
  };
  measure(max_bytes, false);
  if (excess > kMuchMore) measure(max_bytes / excess, false);
  if (measured.empty()) measure(max_bytes / excess, true);
  if (measured.empty())
    throw DataError(fmt::format("{} photos do not fit into {:.1f} MB, whatever is done to them",
                                lumigraph.scene().views.size(), max_bytes / 1e6),
                    "give more with --max-mb, or a folder instead of one page (-o DIR)");
  std::ranges::stable_sort(measured, std::greater(), &PhotoReduction::mb);
  tried.insert(tried.end(), measured.begin(), measured.end());
  return Reduce(lumigraph, *std::ranges::max_element(measured, {}, &PhotoReduction::psnr_db), sink);
}

}  // namespace lumi
