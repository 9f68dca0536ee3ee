// The reconstruction's options, in groups. What has no effect under the other settings is disabled and says why.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "render/radiance/setting_options.h"
#include "render/viewer/panel_parts.h"
#include "render/viewer/refiner.h"
#include "render/viewer/setting_rules.h"

namespace lumi {
namespace {

// Wraps an option's widgets: disables them if the option has no effect, shows its help (and the data's evidence) as a
// tooltip, and reconciles other settings after a change.
class Row {
 public:
  Row(ViewerSettings& v, const char* option, std::string evidence = {})
      : settings_(v.radiance),
        before_(v.radiance),
        option_(option),
        why_(WhyWithoutEffect(v.radiance, option)),
        evidence_(std::move(evidence)) {
    // The picture at rest may read it even if the moving one does not.
    if (!why_.empty() && v.Refines() && WhyWithoutEffect(OptimalSettings(v.radiance), option).empty()) why_.clear();
    ImGui::PushID(option);
    ImGui::BeginDisabled(!why_.empty());
  }
  ~Row() {
    ImGui::EndDisabled();
    ImGui::PopID();
    const SettingOption* option = FindSettingOption(option_);
    std::string text = option ? option->help : "";
    if (!evidence_.empty()) text += "\n\nin this scene: " + evidence_;
    if (!why_.empty()) text += "\n\nno effect now: " + why_;
    Tooltip(text);
    if (!(settings_ == before_)) Reconcile(settings_, option_);
  }
  Row(const Row&) = delete;
  Row& operator=(const Row&) = delete;

 private:
  RadianceSettings& settings_;
  RadianceSettings before_;
  std::string_view option_;
  std::string why_, evidence_;
};

// An option's widget, as its table has it.
void OptionRow(ViewerSettings& v, const SettingOption& o, const std::string& evidence = {}) {
  if (!o.row.label) return;
  RadianceSettings& s = v.radiance;
  const std::string name(o.name);
  const Row row(v, name.c_str(), evidence);
  const OptionValue now = o.get(s);
  if (const auto* flag = std::get_if<bool RadianceSettings::*>(&o.field)) {
    ImGui::Checkbox(o.row.label, &(s.**flag));
  } else if (const auto* field = std::get_if<double RadianceSettings::*>(&o.field)) {
    auto value = static_cast<float>(s.**field / o.unit);
    if (ImGui::SliderFloat(o.row.label, &value, static_cast<float>(o.row.low), static_cast<float>(o.row.high),
                           o.row.format, ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp))
      s.** field = o.unit * static_cast<double>(value);
  } else if (!o.choices.empty()) {
    if (!ImGui::BeginCombo(o.row.label, Text(now).c_str())) return;
    for (const std::string& choice : o.choices)
      if (ImGui::Selectable(choice.c_str(), choice == Text(now))) o.set(s, choice);
    ImGui::EndCombo();
  } else {  // two numbers
    float range[2] = {};
    std::sscanf(Text(now).c_str(), "%f,%f", &range[0], &range[1]);
    if (!ImGui::DragFloat2(o.row.label, range, 0.01F, static_cast<float>(o.row.low), static_cast<float>(o.row.high),
                           "%.2f", ImGuiSliderFlags_AlwaysClamp))
      return;
    const RadianceSettings before = s;
    o.set(s, fmt::format("{:g},{:g}", range[0], range[1]));
    if (!o.problem(s).empty()) s = before;
  }
}
void OptionRow(ViewerSettings& v, const char* name) { OptionRow(v, *FindSettingOption(name)); }

void Weights(ViewerSettings& v) {
  RadianceSettings& s = v.radiance;
  OptionRow(v, "method");
  OptionRow(v, "similarity");
  {
    const Row row(v, "k");
    int k = s.k == 0 ? kMaxBlend + 1 : s.k;
    if (ImGui::SliderInt("photos a pixel", &k, 1, kMaxBlend + 1, s.k == 0 ? "all" : "%d", ImGuiSliderFlags_AlwaysClamp))
      s.k = k > kMaxBlend ? 0 : k;
  }
  OptionRow(v, "correlation");
  OptionRow(v, "alpha");
  OptionRow(v, "r-min-deg");
  OptionRow(v, "r-max-deg");
  OptionRow(v, "noise");
  OptionRow(v, "sum");
  OptionRow(v, "combine");
  OptionRow(v, "cutoff-deg");
  {
    const Row row(v, "accuracy");
    constexpr int kFinest = -8, kCoarsest = -1;
    int exponent = std::clamp(static_cast<int>(std::lround(std::log10(s.accuracy))), kFinest, kCoarsest);
    if (ImGui::SliderInt("accuracy", &exponent, kFinest, kCoarsest, "1e%d", ImGuiSliderFlags_AlwaysClamp))
      s.accuracy = std::pow(10.0, exponent);
  }
}

void Samples(ViewerSettings& v) {
  RadianceSettings& s = v.radiance;
  constexpr int kUsualGrid = 25, kMostGrid = 128;
  {
    const Row row(v, "grid");
    bool sparse = s.Sparse();
    if (ImGui::Checkbox("sparse samples of the view", &sparse)) s.grid_columns = s.grid_rows = sparse ? kUsualGrid : 0;
  }
  {
    const Row row(v, "grid");
    ImGui::BeginDisabled(!s.Sparse());
    int size[2] = {s.grid_columns, s.grid_rows};
    if (ImGui::SliderInt2("grid", size, 2, kMostGrid, s.Sparse() ? "%d" : "pixel", ImGuiSliderFlags_AlwaysClamp) &&
        s.Sparse()) {
      s.grid_columns = std::clamp(size[0], 2, kMostGrid);
      s.grid_rows = std::clamp(size[1], 2, kMostGrid);
    }
    ImGui::EndDisabled();
  }
  OptionRow(v, "sampling");
  OptionRow(v, "epipoles");
}

void Effects(const PanelFacts& facts, ViewerSettings& v, PanelWishes& wishes) {
  const auto evidence = [&](std::string_view name) {
    for (const Effect& e : facts.effects)
      if (e.name == name) return std::string(e.on ? "called for; " : "not called for; ") + e.evidence;
    return std::string();
  };
  ImGui::BeginDisabled(facts.effects.empty());
  wishes.auto_effects = ImGui::Button("as the data call for");
  ImGui::EndDisabled();
  if (facts.effects_open) {
    ImGui::SameLine();
    Dim("exposures follow ...");
  }
  for (const SettingOption& o : SettingOptions())
    if (!o.measure.empty() && o.measure != measure::Angle::kName && o.measure != measure::Time::kName)
      OptionRow(v, o, o.is_switch ? evidence(o.measure) : "");
}

void Time(const PanelFacts& facts, ViewerSettings& v) {
  RadianceSettings& s = v.radiance;
  OptionRow(v, "time");
  ImGui::BeginDisabled(!s.time);
  if (facts.period_s > 0) {
    auto phase = static_cast<float>(s.time_s / facts.period_s - std::floor(s.time_s / facts.period_s));
    if (ImGui::SliderFloat("phase", &phase, 0, 1, "%.3f", ImGuiSliderFlags_AlwaysClamp))
      s.time_s = static_cast<double>(phase) * facts.period_s;
    Tooltip(fmt::format("Of the scene's period of {:.3f} s", facts.period_s));
  } else {
    auto t = static_cast<float>(s.time_s);
    if (ImGui::SliderFloat("time", &t, static_cast<float>(facts.times.first), static_cast<float>(facts.times.second),
                           "%.2f s", ImGuiSliderFlags_AlwaysClamp))
      s.time_s = static_cast<double>(t);
  }
  if (ImGui::Button(v.play_time ? "pause" : "play", {5 * ImGui::GetFontSize(), 0})) v.play_time = !v.play_time;
  ImGui::EndDisabled();
  OptionRow(v, "time-window-s");
  OptionRow(v, "epsilon");
}

void Cost(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes) {
  ImGui::Text("%.1f ms a picture", facts.picture_ms);
  if (facts.plan_ms > 0) {
    ImGui::SameLine();
    Dim(fmt::format("CPU {:.1f}, GPU {:.1f}", facts.plan_ms, std::max(0.0, facts.picture_ms - facts.plan_ms)));
  }
  bool held = settings.budget_ms > 0;
  constexpr double kUsualBudget = 33;
  if (ImGui::Checkbox("hold", &held)) settings.budget_ms = held ? kUsualBudget : 0;
  Tooltip("While the camera moves, settings are chosen that keep this time; at rest the picture is refined.");
  ImGui::SameLine();
  ImGui::BeginDisabled(!held);
  ImGui::SetNextItemWidth(9 * ImGui::GetFontSize());
  auto ms = static_cast<float>(held ? settings.budget_ms : kUsualBudget);
  if (ImGui::SliderFloat("while moving", &ms, 4, 250, "%.0f ms",
                         ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp) &&
      held)
    settings.budget_ms = static_cast<double>(ms);
  ImGui::EndDisabled();
  if (held && !facts.budget_now.empty()) Dim("moving: " + facts.budget_now);
  bool refines = settings.Refines();
  if (ImGui::Checkbox("refine at rest", &refines)) settings.refine = refines;
  Tooltip("The optimum at every pixel, drawn on the processor's cores while nothing moves.");
  ImGui::BeginDisabled(facts.measuring || facts.recording || facts.nearest_photo < 0);
  wishes.measure = ImGui::Button(facts.measuring ? "measuring ..." : "measure error here");
  ImGui::EndDisabled();
  Tooltip(
      "Draws the nearest photo's own view without that photo, by the current settings, and compares it with the photo "
      "(PSNR over all "
      "pixels, a hole is black).");
  ImGui::BeginDisabled(facts.difference_texture == 0);
  ImGui::SameLine();
  ImGui::Checkbox("difference", &settings.difference);
  ImGui::EndDisabled();
  Tooltip("Where that picture and the photo differ, four times as strong.");
  constexpr std::size_t kLines = 3;
  const std::size_t first = facts.errors.size() > kLines ? facts.errors.size() - kLines : 0;
  for (std::size_t i = facts.errors.size(); i-- > first;) {
    const MeasuredError& e = facts.errors[i];
    ImGui::Text("%.2f dB", e.psnr_db);
    ImGui::SameLine();
    Dim(fmt::format("{}, {:.0f} ms{}", e.photo, e.ms,
                    e.coverage < 0.9995 ? fmt::format(", {:.1f} % covered", 100 * e.coverage) : ""));
    ImGui::Indent();
    Wrapped(kDim, Describe(e.settings));
    ImGui::Unindent();
  }
}

}  // namespace

void SettingGroups(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes) {
  if (Group(settings, "cost and error", true)) Cost(facts, settings, wishes);
  if (Group(settings, "weights", true)) Weights(settings);
  if (Group(settings, "samples", false)) Samples(settings);
  if (Group(settings, "effects", false)) Effects(facts, settings, wishes);
  if (facts.times.second > facts.times.first && Group(settings, "time", true)) Time(facts, settings);
}

}  // namespace lumi
