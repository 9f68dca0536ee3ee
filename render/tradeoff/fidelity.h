// Settings for a path that look like weights at every pixel but cost less: sparse samples, as the scene's front
// recommends them or candidates from 25x25 on, compared with weights at every pixel on a few of the path's frames.
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
  std::string failed;        // why there is no PSNR; empty: there is one
};

struct FidelityChoice {
  double wanted_db = 0;
  std::string name;           // of `settings`
  RadianceSettings settings;  // the choice: weights at every pixel if no sparse samples are near enough
  std::optional<double> db;   // of the worst frame, against the same weights at every pixel; nullopt: these were chosen
  double ms = 0, pixel_ms = 0;  // median over the compared frames: with the choice, and with weights at every pixel
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
// and 100x100 samples. With `fixed` applied; settings that this makes equal, invalid or dense are left out.
std::vector<FrontPoint> FidelityTable(const RadianceSettings& base, const std::vector<FrontPoint>& points,
                                      const FixedOptions& fixed);

// The first of `table` of which every request's picture is at least `wanted_db` from its own weights at every pixel.
// The requests' settings are `base` at each one's moment (RadianceSettings::time_s), which trials keep. Settings that
// the backend does not support are skipped and listed in `tried`.
FidelityChoice ChooseFaithful(Renderer& renderer, const std::vector<RenderRequest>& requests,
                              const RadianceSettings& base, const std::vector<FrontPoint>& table, double wanted_db);

// The same with the scene's front, where it has one for this proxy, backend, device and size.
FidelityChoice ChooseFaithful(const std::filesystem::path& scene_folder, const std::string& backend,
                              const std::string& proxy, Renderer& renderer, const std::vector<RenderRequest>& requests,
                              const RadianceSettings& base, const FixedOptions& fixed, double wanted_db);

}  // namespace lumi
