#include "render/tradeoff/front.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/settings_json.h"
#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kFormat = "lumigraph-front";
constexpr int kFormatVersion = 1;

// FNV-1a, 32 bits: a short name for a device; the file holds the device in full.
std::string ShortHash(const std::string& text) {
  std::uint32_t h = 2166136261U;
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 16777619U;
  return fmt::format("{:08x}", h);
}

std::vector<CostAndQuality> AxesOf(const std::vector<FrontPoint>& points) {
  std::vector<CostAndQuality> axes;
  for (const FrontPoint& p : points) axes.push_back({p.ms, p.Quality()});
  return axes;
}

// As a file has it.
struct FrontFile {
  std::string format = kFormat;
  int version = kFormatVersion;
  StoredFront front;
};

}  // namespace

std::vector<FrontPoint> ParetoFront(const std::vector<FrontPoint>& points) {
  std::vector<FrontPoint> front;
  for (const std::size_t i : ParetoFront(AxesOf(points))) front.push_back(points[i]);
  return front;
}

std::size_t Recommend(const std::vector<FrontPoint>& front, std::optional<double> budget_ms, bool* fits) {
  const Recommended best = RecommendedRow(AxesOf(front), budget_ms);
  if (fits != nullptr) *fits = best.fits;
  return best.row;
}

RadianceSettings WithTradedSettings(const RadianceSettings& base, const RadianceSettings& point) {
  RadianceSettings s = base;
  s.similarity = point.similarity;
  s.k = point.k;
  s.correlation = point.correlation;
  s.combine = point.combine;
  s.sum = point.sum;
  s.cutoff_rad = point.cutoff_rad;
  s.resolution = point.resolution;
  s.grid_columns = point.grid_columns;
  s.grid_rows = point.grid_rows;
  s.epipoles = point.epipoles;
  s.sampling = point.sampling;
  return s;
}

void ListKeys(JsonKeys& j, FrontPoint& p) {
  j("name", p.name, "settings", p.settings, "ms", p.ms, "psnr_optimum_db", p.psnr_optimum_db, "psnr_holdout_db",
    p.psnr_holdout_db);
}

void ListKeys(JsonKeys& j, FrontFile& f) {
  FrontKey& k = f.front.key;
  j("format", f.format, "version", f.version).Say("suite", kVersion);
  j("proxy", k.proxy, "backend", k.backend, "device", k.device, "width", k.width, "height", k.height,
    "proxy_fingerprint", f.front.proxy_fingerprint, "points", f.front.points);
}

StoredFront ReadFront(const fs::path& file) {
  FrontFile read;
  StoredFront& front = read.front;
  const auto require_known = [&] {
    if (read.format != kFormat) throw InputError(file, "not a front");
    if (read.version > kFormatVersion) throw InputError(file, "a newer version's front");
  };
  try {
    const bool complete = JsonKeys::Read(file, "a front").Into(read);
    require_known();
    if (!complete) throw InputError(file, "not a front: keys are missing, or not of their type");
  } catch (const UsageError& e) {  // settings of the points, which are read last
    require_known();
    throw InputError(file, e.what());
  }
  if (front.key.width < 1 || front.key.height < 1) throw InputError(file, "a front without a size");
  for (const FrontPoint& p : front.points)
    if (const std::string problem = Validate(p.settings); !problem.empty()) throw InputError(file, problem);
  front.points = ParetoFront(front.points);
  if (front.points.empty()) throw InputError(file, "a front without points");
  return front;
}

fs::path WriteFront(const fs::path& scene_folder, const StoredFront& front) {
  const FrontKey& k = front.key;
  const fs::path file = scene_folder / "fronts" /
                        fmt::format("{}-{}-{}x{}-{}.json", k.proxy, k.backend, k.width, k.height, ShortHash(k.device));
  WriteTextAtomically(file, JsonKeys(FrontFile{.front = front}).Text(1) + "\n");
  RecordMeasured(scene_folder, "front-" + file.stem().string(), {file});
  return file;
}

std::optional<StoredFront> FindFront(const fs::path& scene_folder, const FrontKey& key, std::string* why) {
  const auto say = [&](std::string text) {
    if (why != nullptr) *why = std::move(text);
  };
  say("the scene has no measured front for this proxy and backend");
  std::error_code ec;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(scene_folder / "fronts", ec))
    if (entry.path().extension() == ".json" && !entry.path().filename().string().starts_with('.'))
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  const std::string fingerprint = Fingerprint(ProxyPath(scene_folder, key.proxy));
  const double wanted = static_cast<double>(key.width) * key.height;
  std::optional<StoredFront> best;
  double least = 0;
  for (const fs::path& file : files) {
    StoredFront front;
    try {
      front = ReadFront(file);
    } catch (const InputError& e) {
      say("the scene's front cannot be read: " + e.file().filename().string() + ": " + e.what());
      continue;
    }
    if (front.key.proxy != key.proxy || front.key.backend != key.backend) continue;
    if (front.key.device != key.device) {
      say("the scene's front was measured on another device (" + front.key.device + ")");
      continue;
    }
    if (front.proxy_fingerprint != fingerprint) {
      say("the proxy has changed since the scene's front was measured");
      continue;
    }
    const double pixels = static_cast<double>(front.key.width) * front.key.height;
    const double distance = std::abs(std::log(wanted / pixels));
    if (best && distance >= least) continue;
    least = distance;
    front.time_scale = wanted / pixels;
    best = std::move(front);
  }
  if (best)
    for (FrontPoint& p : best->points) p.ms *= best->time_scale;
  return best;
}

}  // namespace lumi
