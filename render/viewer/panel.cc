#include "render/viewer/panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "render/viewer/panel_parts.h"

namespace lumi {
namespace {

// A wheel over the list scrolls it; the arrows of the keyboard belong to the picture.
void PhotoList(const PanelFacts& facts, PanelWishes& wishes) {
  const std::string now =
      facts.nearest_photo < 0 ? "" : facts.photo_names[static_cast<std::size_t>(facts.nearest_photo)];
  if (!ImGui::BeginCombo("photo", now.c_str(), ImGuiComboFlags_HeightLarge)) return;
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(facts.photo_names.size()));
  while (clipper.Step())
    for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i)
      if (ImGui::Selectable(fmt::format("{}##{}", facts.photo_names[static_cast<std::size_t>(i)], i).c_str(),
                            i == facts.nearest_photo))
        wishes.jump_to = i;
  ImGui::EndCombo();
}

void Help() {
  static constexpr const char* kLines[][2] = {{"left drag", "orbit"},
                                              {"right drag", "look around"},
                                              {"middle, Shift+left drag", "pan"},
                                              {"double click", "orbit about this point"},
                                              {"wheel", "nearer, farther"},
                                              {"Ctrl+wheel", "field of view"},
                                              {"W A S D, Q E", "fly (Shift: faster)"},
                                              {"left, right arrow", "photo before, after"},
                                              {"Home", "back to the start"},
                                              {"[ ]", "fewer, more photos a pixel"},
                                              {"F", "false colours"},
                                              {"B", "fill what no photo sees"},
                                              {"C", "photos' cameras"},
                                              {"K", "key of the camera path"},
                                              {"Space", "play, stop the path"},
                                              {"M", "mark a point, to measure"},
                                              {"P", "proxy's edges"},
                                              {"G", "proxy, flat-shaded"},
                                              {"N", "next proxy"},
                                              {"Tab", "panel"},
                                              {"F12", "screenshot"},
                                              {"H", "this help"},
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
  if (facts.refined)
    Dim(fmt::format("optimal weights, {:.1f} s", facts.refinement_s));
  else if (facts.refining)
    Dim(fmt::format("optimal weights: {:.0f} %", 100 * facts.refined_fraction));
  const int open = facts.on_demand ? 0 : facts.photos_total - facts.photos_loaded - facts.photos_failed;
  if (open > 0)
    ImGui::ProgressBar(static_cast<float>(facts.photos_loaded) / static_cast<float>(std::max(1, facts.photos_total)),
                       ImVec2(-1, 0), fmt::format("{} of {} photos", facts.photos_loaded, facts.photos_total).c_str());
  std::string memory = open > 0          ? ""
                       : facts.on_demand ? fmt::format("{} of {} photos, ", facts.photos_loaded, facts.photos_total)
                                         : fmt::format("{} photos, ", facts.photos_loaded);
  memory += fmt::format("{:.0f} of {:.0f} MB", facts.photo_mb, facts.budget_mb);
  Dim(memory);
  if (facts.photos_failed > 0) Wrapped(kWarm, fmt::format("{} photos could not be read", facts.photos_failed));
  if (!facts.problem.empty()) Wrapped(kWarm, facts.problem);
}

// The heat map's colours and what their ends stand for.
void Legend(const PanelFacts& facts) {
  // Viridis at 0, 1/8 ... 1 (S. van der Walt, N. Smith, CC0).
  constexpr ImU32 kViridis[] = {IM_COL32(68, 1, 84, 255),    IM_COL32(71, 44, 122, 255),  IM_COL32(59, 81, 139, 255),
                                IM_COL32(44, 113, 142, 255), IM_COL32(33, 144, 141, 255), IM_COL32(39, 173, 129, 255),
                                IM_COL32(92, 200, 99, 255),  IM_COL32(170, 220, 50, 255), IM_COL32(253, 231, 37, 255)};
  const ImVec2 x = ImGui::GetCursorScreenPos();
  const float width = ImGui::CalcItemWidth(), height = 0.6F * ImGui::GetFontSize();
  constexpr int kSteps = static_cast<int>(std::size(kViridis)) - 1;
  for (int i = 0; i < kSteps; ++i)
    ImGui::GetWindowDrawList()->AddRectFilledMultiColor(
        {x.x + width * static_cast<float>(i) / kSteps, x.y},
        {x.x + width * static_cast<float>(i + 1) / kSteps, x.y + height}, kViridis[i], kViridis[i + 1], kViridis[i + 1],
        kViridis[i]);
  ImGui::Dummy({width, height});
  Dim(fmt::format("{:.3g} to {:.3g}{}{}", facts.heat_low, facts.heat_high, facts.heat_unit.empty() ? "" : " ",
                  facts.heat_unit));
}

// The photos of false colours, those that give most of the picture first.
void ColorLegend(const PanelFacts& facts) {
  constexpr std::size_t kMost = 12;
  for (std::size_t i = 0; i < std::min(kMost, facts.color_legend.size()); ++i) {
    const LegendEntry& entry = facts.color_legend[i];
    const unsigned rgb = static_cast<unsigned>(std::stoul(entry.color.substr(1), nullptr, 16));
    const ImVec2 x = ImGui::GetCursorScreenPos();
    const float side = ImGui::GetTextLineHeight();
    ImGui::GetWindowDrawList()->AddRectFilled({x.x, x.y}, {x.x + side, x.y + side},
                                              IM_COL32(rgb >> 16, rgb >> 8 & 255U, rgb & 255U, 255));
    ImGui::Dummy({side, side});
    ImGui::SameLine();
    Dim(fmt::format("{:4.1f} %  {}", 100 * entry.share, entry.photo));
  }
  if (facts.color_legend.size() > kMost) Dim(fmt::format("and {} more", facts.color_legend.size() - kMost));
}

// The distance between the marks, and a field for the true distance, which sets the scale.
void Scale(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes) {
  if (facts.marks.size() < 2) return;
  Dim(LengthText((facts.marks[0] - facts.marks[1]).norm(), facts.metres_per_unit) + " between the marks");
  ImGui::InputDouble("metres", &settings.distance_m, 0, 0, "%.4g");
  ImGui::SameLine();
  ImGui::BeginDisabled(!(settings.distance_m > 0));
  if (ImGui::Button("set")) wishes.distance_m = settings.distance_m;
  ImGui::EndDisabled();
  Tooltip("The marks are so far apart: the scene gets that scale, and keeps it");
}

void SceneGroup(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes) {
  PhotoList(facts, wishes);
  if (ImGui::BeginCombo("proxy", facts.proxy.c_str())) {
    for (const std::string& name : facts.proxies)
      if (ImGui::Selectable(name.c_str(), name == facts.proxy)) wishes.proxy = name;
    ImGui::EndCombo();
  }
  Tooltip(facts.proxy_loading ? "loading the proxy ..." : fmt::format("{} faces", facts.faces));
  if (ImGui::BeginCombo("show", std::string(NameOf(settings.seen)).c_str(), ImGuiComboFlags_HeightLarge)) {
    for (const SeenName& n : SeenNames()) {
      const bool applies = n.seen.show != Show::kTessellation || settings.radiance.Sparse();
      ImGui::BeginDisabled(!applies);
      if (ImGui::Selectable(std::string(n.name).c_str(), n.seen == settings.seen)) settings.seen = n.seen;
      ImGui::EndDisabled();
      Tooltip(std::string(n.help) + (applies ? "" : ": there are none without a grid"));
    }
    ImGui::EndCombo();
  }
  if (facts.heat) Legend(facts);
  ColorLegend(facts);
  ImGui::Checkbox("cameras", &settings.frusta);
  ImGui::SameLine();
  ImGui::Checkbox("edges", &settings.mesh);
  Tooltip("The proxy's edges");
  ImGui::SameLine();
  ImGui::Checkbox("path", &settings.path);
  ImGui::SameLine();
  ImGui::BeginDisabled(!(settings.seen == Seen{}) || settings.difference);
  ImGui::Checkbox("fill", &settings.fill);
  ImGui::EndDisabled();
  Tooltip("What no photo sees gets smooth colours from around it; not in heat maps, and not while an error is shown");
  ImGui::Checkbox("help", &settings.help);
  ImGui::SameLine();
  wishes.home = ImGui::Button("home");
  ImGui::SameLine();
  wishes.screenshot = ImGui::Button("screenshot");
  Scale(facts, settings, wishes);
}

}  // namespace

const std::vector<std::string>& PanelGroups() {
  static const std::vector<std::string> names = {"scene", "cost and error", "weights",   "samples", "effects",
                                                 "time",  "camera path",    "recording", "web page"};
  return names;
}

bool Group(ViewerSettings& settings, const char* name, bool open_at_first) {
  const auto said = settings.groups.find(name);
  const bool wanted = said != settings.groups.end() ? said->second : open_at_first;
  ImGui::SetNextItemOpen(wanted);
  const bool open = ImGui::CollapsingHeader(name);
  if (open != wanted) settings.groups[name] = open;
  return open;
}

PanelWishes DrawPanel(const PanelFacts& facts, ViewerSettings& settings) {
  PanelWishes wishes;
  const float unit = ImGui::GetFontSize();
  if (settings.panel) {
    const float height = ImGui::GetIO().DisplaySize.y - 2 * unit, width = 25 * unit;
    ImGui::SetNextWindowPos({unit, unit}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowSizeConstraints({width, 0}, {width, std::max(height, 10 * unit)});
    ImGui::SetNextWindowSize({width, 0},
                             ImGuiCond_Always);  // as high as its groups need, up to the window's own height
    ImGui::Begin(fmt::format("{}###panel", facts.scene).c_str(), nullptr,
                 ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
    ImGui::PushItemWidth(-8.5F * unit);
    Status(facts);
    if (Group(settings, "scene", true)) SceneGroup(facts, settings, wishes);
    SettingGroups(facts, settings, wishes);
    PathGroups(facts, settings, wishes);
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
  if (settings.difference && facts.difference_texture != 0 && !facts.errors.empty()) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float width = 0.4F * size.x;
    ImGui::SetNextWindowPos({size.x - unit, size.y - unit}, ImGuiCond_FirstUseEver, {1, 1});
    ImGui::Begin("difference", &settings.difference,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
    ImGui::Image(reinterpret_cast<ImTextureID>(static_cast<intptr_t>(facts.difference_texture)),
                 {width, width / static_cast<float>(facts.difference_aspect)});
    Dim(fmt::format("{}, {:.2f} dB: |picture - photo|, four times", facts.errors.back().photo,
                    facts.errors.back().psnr_db));
    ImGui::End();
  }
  DrawMessage(facts.message);
  return wishes;
}

void DrawMessage(const std::string& message) {
  if (message.empty()) return;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5F * size.x, size.y - ImGui::GetFontSize()}, ImGuiCond_Always, {0.5F, 1});
  ImGui::Begin("message", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs |
                   ImGuiWindowFlags_NoNav);
  ImGui::TextUnformatted(message.c_str());
  ImGui::End();
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
  else  // unknown length: an animated bar
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

void DrawLine(const Eigen::Vector2d& a_px, const Eigen::Vector2d& b_px) {
  const auto at = [](const Eigen::Vector2d& x) { return ImVec2(static_cast<float>(x.x()), static_cast<float>(x.y())); };
  ImDrawList* draw = ImGui::GetBackgroundDrawList();
  draw->AddLine(at(a_px), at(b_px), IM_COL32(0, 0, 0, 160), 3.5F);
  draw->AddLine(at(a_px), at(b_px), IM_COL32(255, 255, 255, 230), 1.5F);
}

std::string LengthText(double units, const std::optional<double>& metres_per_unit) {
  return metres_per_unit ? fmt::format("{:.4g} m", units * *metres_per_unit) : fmt::format("{:.4g} units", units);
}

}  // namespace lumi
