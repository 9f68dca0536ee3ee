// Settings for a path that look like a weight at every pixel and cost a part of it: sparse samples, as the scene's
// front recommends them or 25x25 candidates, held against a weight at every pixel at a few of the path's frames.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/tradeoff/budget.h"

namespace lumi {

constexpr int kFidelityFrames = 3;  // of a path that are compared

struct FidelityTrial {
  std::string name;          // "candidates 25x25, k 4"
  std::optional<double> db;  // PSNR of the worst frame; 99: equal
  std::string failed;        // why there is none; empty: there is one
};

struct FidelityChoice {
  double wanted_db = 0;
  std::string name;           // of `settings`
  RadianceSettings settings;  // what is taken: a weight at every pixel where nothing sparse is near enough
  std::optional<double>
      db;  // of the worst frame, against the same weights at every pixel; nullopt: they are what is taken
  double ms = 0, pixel_ms = 0;  // a frame, the median of those compared: as taken, and at every pixel
  std::string why;              // one line: where the settings come from, or why none was taken
  std::vector<FidelityTrial> tried;
};
void ListKeys(JsonKeys& j, FidelityChoice& choice);
// One line for people.
std::string Describe(const FidelityChoice& choice);

// Which of `count` frames are compared, ascending: the middles of kFidelityFrames equal parts, or all of fewer.
std::vector<std::size_t> FidelityFrames(std::size_t count);

// Sparse settings that are tried, cheapest first: of a front (`points`, may be empty) those with samples and the
// identity, from the fastest whose quality is within 0.1 dB of such points' best on; then candidates on 25x25, 50x50
// and 100x100 samples. With `fixed` applied; those that this makes equal, invalid or a weight a pixel are left out.
std::vector<FrontPoint> FidelityTable(const RadianceSettings& base, const std::vector<FrontPoint>& points,
                                      const FixedOptions& fixed);

// The first of `table` of which every request's picture is at least `wanted_db` from its own weights at every pixel.
// The requests' settings are `base` at each one's moment (RadianceSettings::time_s), which trials keep. What the
// backend cannot do is passed over, and said.
FidelityChoice ChooseFaithful(Renderer& renderer, const std::vector<RenderRequest>& requests,
                              const RadianceSettings& base, const std::vector<FrontPoint>& table, double wanted_db);

// The same with the scene's front, where it has one for this proxy, backend, device and size.
FidelityChoice ChooseFaithful(const std::filesystem::path& scene_folder, const std::string& backend,
                              const std::string& proxy, Renderer& renderer, const std::vector<RenderRequest>& requests,
                              const RadianceSettings& base, const FixedOptions& fixed, double wanted_db);

}  // namespace lumi
