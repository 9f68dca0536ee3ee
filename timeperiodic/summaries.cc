#include "timeperiodic/summaries.h"

#include <fmt/format.h>

#include <cstdio>

#include "scene/program/with_error.h"

namespace lumi {

static void ListKeys(JsonKeys& j, PeriodCandidate& c) {
  j("period_frames", c.period_frames, "relation", c.relation, "explained", c.explained, "harmonics", c.harmonics);
}
static void ListKeys(JsonKeys& j, Slip& s) { j("frame", s.frame, "frames", s.frames); }
void ListKeys(JsonKeys& j, PeriodSummary& s) {
  PeriodEstimate& e = s.estimate;
  j("period_frames", e.period_frames, "period_sigma_frames", e.sigma_frames).Say("period_s", e.period_frames / s.fps);
  j("fps", s.fps, "frames", s.frames);
  j("cycles", e.cycles, "samples_per_window", s.samples_per_window, "explained", e.explained, "harmonics", e.harmonics,
    "harmonics_considered", e.candidates);
  j("ambiguous", e.ambiguous, "drift_percent", e.drift_percent, "drift_sigma_percent", e.drift_sigma_percent, "drifts",
    e.drifts);
  j("aliases_frames", e.aliases_frames, "camera_share", e.camera_share, "few_cycles", e.few_cycles, "slips", e.slips,
    "warnings", e.warnings);
  j("seconds", s.seconds);
  if (!s.tradeoff) return;
  j.Say("tradeoff", KeysOf(s.tradeoff->table));
  j("tradeoff_json", s.tradeoff->files.json, "tradeoff_csv", s.tradeoff->files.csv, "tradeoff_svg",
    s.tradeoff->files.svg);
}
static std::string Describe(const std::optional<PeriodTradeoff>& tradeoff) {
  if (!tradeoff) return {};
  std::string reference;
  for (const auto& [key, value] : tradeoff->table.facts)
    if (key == "reference") reference = std::get<std::string>(value);
  return "\n\n" + TextOf(tradeoff->table) + "\n* no other setting is both faster and nearer; errors against " +
         reference + "\n" + tradeoff->files.json.string() + ", .csv, .svg";
}
std::string Describe(const PeriodSummary& s) {
  const PeriodEstimate& e = s.estimate;
  return fmt::format(
             "period {} frames ({:.5g} s), {:.1f} of them in {} frames: {:.3g} samples in a window of one frame",
             WithError(e.period_frames, e.sigma_frames), e.period_frames / s.fps, e.cycles, s.frames,
             s.samples_per_window) +
         Describe(s.tradeoff);
}

static void ListKeys(JsonKeys& j, SamplingGap& g) {
  j("phase_from", g.phase_from, "phase_to", g.phase_to, "place_from", g.place_from, "place_to", g.place_to,
    "what_to_film", g.what_to_film);
}
static void ListKeys(JsonKeys& j, SamplingReport& r) {
  j("views", r.views, "samples_per_window", r.samples_per_window, "window_least", r.window_least, "window_most",
    r.window_most, "uniformity", r.uniformity);
  j("covered", r.covered, "half_share", r.half_share, "camera_period_frames", r.camera_period);
  std::optional<std::string> ratio;
  if (r.commensurate > 0) ratio = fmt::format("{}:{}", r.commensurate_p, r.commensurate_q);
  j("commensurate", ratio, "gaps", r.gaps, "warnings", r.warnings);
  if (j.reading() && ratio && std::sscanf(ratio->c_str(), "%d:%d", &r.commensurate_p, &r.commensurate_q) == 2 &&
      r.commensurate_q > 0)
    r.commensurate = static_cast<double>(r.commensurate_p) / r.commensurate_q;
}
static void ListKeys(JsonKeys& j, MasksFigures& m) {
  j("found", m.found)
      .IfAny("moving_share", m.moving_share)
      .IfAny("corners", m.corners)
      .IfAny("aligned_frames", m.aligned_frames);
}
void ListKeys(JsonKeys& j, CalibratedVideo& s) {
  ListKeys(j, s.period);
  j("period_from", s.period_from, "scene", s.scene, "masks", s.masks, "reused", s.reused);
  j.IfAny("reconstruct", s.reconstruct).IfAny("images_registered", s.images_registered).IfAny("sampling", s.sampling);
}
std::string Describe(const CalibratedVideo& s) {
  const PeriodEstimate& e = s.period.estimate;
  std::string lines =
      fmt::format("period {} frames (from the {})", WithError(e.period_frames, e.sigma_frames), s.period_from);
  if (s.masks.found) lines += fmt::format("; {:.1f} % of the picture moves", 100 * s.masks.moving_share.value_or(0));
  if (!s.sampling)
    return lines + "\nmasks in " + s.scene.string() + "/timeperiodic/masks: look at them, and give them with --masks";
  const SamplingReport& r = *s.sampling;
  lines += fmt::format(
      "\n{} of {} frames have a camera: {:.3g} samples in a window of one frame ({:.0f} to {:.0f}), uniformity {:.2f}",
      s.images_registered.value_or(0), s.period.frames, r.samples_per_window, r.window_least, r.window_most,
      r.uniformity);
  for (const SamplingGap& g : r.gaps) lines += "\n  gap: " + g.what_to_film;
  return lines + Describe(s.period.tradeoff);
}

void ListKeys(JsonKeys& j, SceneSampling& s) {
  ListKeys(j, s.report);
  j("period_frames", s.period_frames, "period_s", s.period_s, "fps", s.fps);
}
std::string Describe(const SceneSampling& s) { return JsonKeys(s).Text(1); }

}  // namespace lumi
