// What accuracy costs, measured: the points of a sweep, their Pareto front, what to take for a given time, and the
// files in SCENE/fronts that keep it for `--budget-ms` and the viewer.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/radiance/settings.h"
#include "scene/files/json_keys.h"
#include "scene/tradeoff/front.h"

namespace lumi {

struct FrontPoint {
  std::string name;  // "candidates 25x25, k 4"
  RadianceSettings settings;
  double ms = 0;                          // a frame, median
  std::optional<double> psnr_optimum_db;  // against the optimum at every pixel
  std::optional<double> psnr_holdout_db;  // against the photos of the choosing fold

  // The quality axis of the front: PSNR against held-out photos if known, else against the optimum.
  double Quality() const {
    return psnr_holdout_db ? *psnr_holdout_db : psnr_optimum_db.value_or(CostAndQuality::kNone);
  }
};

// The points that no other is both faster and better than: ms and quality ascend, strictly. Points without a finite
// time or quality are left out.
std::vector<FrontPoint> ParetoFront(const std::vector<FrontPoint>& points);

// The best point of a front within the budget (nullopt: no limit); where none fits, the fastest, and *fits is false.
// Throws std::invalid_argument for an empty front.
std::size_t Recommend(const std::vector<FrontPoint>& front, std::optional<double> budget_ms, bool* fits = nullptr);

// A scene's front holds for one proxy, backend and device, at one size.
struct FrontKey {
  std::string proxy, backend, device;
  int width = 0, height = 0;
};

struct StoredFront {
  FrontKey key;
  std::string proxy_fingerprint;   // of proxies/NAME.ply when it was measured
  std::vector<FrontPoint> points;  // a Pareto front
  double time_scale = 1;           // FindFront: by which it multiplied the times, for another size
};

// `base` with those settings of `point` that trade accuracy for time; what a scene or a user decides (weights of the
// measures, effects, radii, time) stays as in `base`.
RadianceSettings WithTradedSettings(const RadianceSettings& base, const RadianceSettings& point);

// Throws InputError naming the file.
StoredFront ReadFront(const std::filesystem::path& file);

// SCENE/fronts/PROXY-BACKEND-WxH-HASH.json (the hash is the device's), atomically. The scene should be locked.
std::filesystem::path WriteFront(const std::filesystem::path& scene_folder, const StoredFront& front);

// The front of this proxy, backend and device whose size is nearest in pixels, its times scaled in proportion to the
// pixels. nullopt, with *why, if there is none: fronts of other machines, or of a proxy that has changed since, do not
// count. Unreadable files count as absent and are named in *why.
std::optional<StoredFront> FindFront(const std::filesystem::path& scene_folder, const FrontKey& key,
                                     std::string* why = nullptr);

}  // namespace lumi
