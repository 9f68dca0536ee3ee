// What the panel's files share.
#pragma once

#include <imgui.h>

#include <string>

#include "render/viewer/panel.h"

namespace lumi {

inline const ImVec4 kDim{0.62F, 0.65F, 0.70F, 1.0F};
inline const ImVec4 kWarm{0.98F, 0.72F, 0.38F, 1.0F};

inline void Dim(const std::string& text) { ImGui::TextColored(kDim, "%s", text.c_str()); }

// Wrapped at the panel's edge.
inline void Wrapped(const ImVec4& color, const std::string& text) {
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::PushTextWrapPos(0);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
}

// Of the last item, disabled or not.
inline void Tooltip(const std::string& text) {
  if (text.empty() || !ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled)) return;
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(24 * ImGui::GetFontSize());
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

// A group with a head that opens and closes it.
bool Group(ViewerSettings& settings, const char* name, bool open_at_first);

void SettingGroups(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes);
void PathGroups(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes);

}  // namespace lumi
