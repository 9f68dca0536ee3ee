#include "render/viewer/panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

namespace lumi {
namespace {

const ImVec4 kDim{0.62F, 0.65F, 0.70F, 1.0F};
const ImVec4 kWarm{0.98F, 0.72F, 0.38F, 1.0F};

void Dim(const std::string& text) { ImGui::TextColored(kDim, "%s", text.c_str()); }

// A wheel over the list scrolls it; the arrows of the keyboard belong to the picture.
void PhotoList(const PanelFacts& facts, PanelWishes& wishes) {
  const std::string now = facts.nearest_photo < 0 ? "" : facts.photo_names[static_cast<std::size_t>(facts.nearest_photo)];
  if (!ImGui::BeginCombo("photo", now.c_str(), ImGuiComboFlags_HeightLarge)) return;
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(facts.photo_names.size()));
  while (clipper.Step())
    for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i)
      if (ImGui::Selectable(fmt::format("{}##{}", facts.photo_names[static_cast<std::size_t>(i)], i).c_str(), i == facts.nearest_photo))
        wishes.jump_to = i;
  ImGui::EndCombo();
}

void Blending(ViewerSettings& settings) {
  RadianceSettings& r = settings.radiance;
  bool all = r.k == 0;
  ImGui::BeginDisabled(all);
  int k = all ? kMaxBlend : r.k;
  if (ImGui::SliderInt("photos a pixel", &k, 1, kMaxBlend, all ? "all" : "%d") && !all) r.k = std::clamp(k, 1, kMaxBlend);
  ImGui::EndDisabled();
  if (ImGui::Checkbox("all", &all)) r.k = all ? 0 : 4;
  ImGui::SameLine();
  ImGui::Checkbox("prefilter", &r.prefilter);
  ImGui::SameLine();
  ImGui::Checkbox("visibility", &r.visibility);
  auto gamma = static_cast<float>(r.gamma);
  if (ImGui::SliderFloat("field of view", &gamma, 0, 10, "%.2f", ImGuiSliderFlags_Logarithmic))
    r.gamma = std::clamp(static_cast<double>(gamma), 0.0, 1000.0);
  auto feather = static_cast<float>(r.fov_feather);
  if (ImGui::SliderFloat("feather", &feather, 0.005F, 0.5F, "%.3f", ImGuiSliderFlags_Logarithmic))
    r.fov_feather = std::clamp(static_cast<double>(feather), 0.001, 0.5);
}

void Help() {
  static constexpr const char* kLines[][2] = {
      {"left drag", "orbit"},           {"right drag", "look around"},
      {"middle, Shift+left drag", "pan"}, {"double click", "orbit about this point"},
      {"wheel", "nearer, farther"},     {"Ctrl+wheel", "field of view"},
      {"W A S D, Q E", "fly (Shift: faster)"}, {"left, right arrow", "photo before, after"},
      {"Home", "back to the start"},    {"[ ]", "fewer, more photos a pixel"},
      {"F", "false colours"},           {"C", "photos' cameras"},
      {"P", "proxy's edges"},           {"Tab", "panel"},
      {"F12", "screenshot"},            {"H", "this help"},
      {"Esc", "quit"}};
  if (!ImGui::BeginTable("help", 2, ImGuiTableFlags_SizingFixedFit)) return;
  for (const auto& line : kLines) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    Dim(line[0]);
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(line[1]);
  }
  ImGui::EndTable();
}

void Status(const PanelFacts& facts) {
  ImGui::Text("%.1f ms a frame", facts.frame_ms);
  ImGui::SameLine();
  Dim(facts.complete ? "full resolution" : fmt::format("{:.0f} % resolution", 100 * facts.scale));
  Dim(facts.device);
  const int open = facts.photos_total - facts.photos_loaded - facts.photos_failed;
  if (open > 0)
    ImGui::ProgressBar(static_cast<float>(facts.photos_loaded) / static_cast<float>(std::max(1, facts.photos_total)), ImVec2(-1, 0),
                       fmt::format("{} of {} photos", facts.photos_loaded, facts.photos_total).c_str());
  else
    ImGui::Text("%d photos", facts.photos_loaded);
  std::string memory = fmt::format("{:.0f} of {:.0f} MB", facts.photo_mb, facts.budget_mb);
  if (facts.halvings > 0) memory += fmt::format(", photos at 1/{}", 1 << facts.halvings);
  Dim(memory);
  if (facts.photos_failed > 0)
    ImGui::TextColored(kWarm, "%s", fmt::format("{} photos could not be read", facts.photos_failed).c_str());
}

}  // namespace

PanelWishes DrawPanel(const PanelFacts& facts, ViewerSettings& settings) {
  PanelWishes wishes;
  const float unit = ImGui::GetFontSize();
  if (settings.panel) {
    ImGui::SetNextWindowPos({unit, unit}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSize({23 * unit, 0}, ImGuiCond_FirstUseEver);
    ImGui::Begin(fmt::format("{}###panel", facts.scene).c_str(), nullptr, ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
    ImGui::PushItemWidth(-8 * unit);
    Status(facts);
    ImGui::Separator();
    PhotoList(facts, wishes);
    if (ImGui::BeginCombo("proxy", facts.proxy.c_str())) {
      for (const std::string& name : facts.proxies)
        if (ImGui::Selectable(name.c_str(), name == facts.proxy)) wishes.proxy = name;
      ImGui::EndCombo();
    }
    Dim(facts.proxy_loading ? "loading the proxy ..." : fmt::format("{} faces", facts.faces));
    ImGui::Separator();
    int show = settings.show == Show::kColor ? 0 : 1;
    ImGui::RadioButton("photos' colours", &show, 0);
    ImGui::SameLine();
    ImGui::RadioButton("false colours", &show, 1);
    settings.show = show == 0 ? Show::kColor : Show::kFalseColor;
    Blending(settings);
    ImGui::Separator();
    ImGui::Checkbox("cameras", &settings.frusta);
    ImGui::SameLine();
    ImGui::Checkbox("proxy", &settings.mesh);
    ImGui::SameLine();
    ImGui::Checkbox("help", &settings.help);
    wishes.home = ImGui::Button("home");
    ImGui::SameLine();
    wishes.screenshot = ImGui::Button("screenshot");
    ImGui::PopItemWidth();
    ImGui::End();
  }
  if (settings.help) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({size.x - unit, unit}, ImGuiCond_FirstUseEver, {1, 0});
    ImGui::Begin("keys and mouse", &settings.help,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
    Help();
    ImGui::End();
  }
  if (!facts.message.empty()) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({0.5F * size.x, size.y - unit}, ImGuiCond_Always, {0.5F, 1});
    ImGui::Begin("message", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoNav);
    ImGui::TextUnformatted(facts.message.c_str());
    ImGui::End();
  }
  return wishes;
}

void DrawOpening(const std::string& scene, const std::string& task, double fraction) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float unit = ImGui::GetFontSize();
  ImGui::SetNextWindowPos({0.5F * size.x, 0.5F * size.y}, ImGuiCond_Always, {0.5F, 0.5F});
  ImGui::SetNextWindowSize({std::min(28 * unit, size.x), 0});
  ImGui::Begin("opening", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoNav);
  ImGui::TextUnformatted(("opening " + scene).c_str());
  if (fraction >= 0)
    ImGui::ProgressBar(static_cast<float>(fraction), ImVec2(-1, 0));
  else  // its length is not known: something that moves
    ImGui::ProgressBar(static_cast<float>(0.5 - 0.5 * std::cos(2 * ImGui::GetTime())), ImVec2(-1, 0), "");
  Dim(task.empty() ? "reading the scene" : task);
  ImGui::End();
}

void DrawPivot(double x_px, double y_px, double pixel_density) {
  const ImVec2 x{static_cast<float>(x_px / pixel_density), static_cast<float>(y_px / pixel_density)};
  ImDrawList* draw = ImGui::GetBackgroundDrawList();
  draw->AddCircle(x, 7, IM_COL32(0, 0, 0, 160), 24, 3.5F);
  draw->AddCircle(x, 7, IM_COL32(255, 255, 255, 230), 24, 1.5F);
  draw->AddCircleFilled(x, 1.8F, IM_COL32(255, 255, 255, 230));
}

}  // namespace lumi
