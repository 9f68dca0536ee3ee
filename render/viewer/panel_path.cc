// The camera path's keyframes, its playback, its files, and recording.
#include <fmt/format.h>

#include <algorithm>

#include "render/viewer/panel_parts.h"

namespace lumi {
namespace {

constexpr int kMostVideoSide = 8192;

void Wish(PanelWishes& wishes, bool pressed, ScriptVerb verb, std::vector<double> numbers = {}, std::string word = {}) {
  if (pressed) wishes.path.push_back({verb, std::move(numbers), std::move(word), {}, {}});
}

void Keys(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes) {
  const CameraPath& path = facts.path;
  const float unit = ImGui::GetFontSize();
  const double key = settings.selected_key;
  const bool selected = settings.selected_key >= 0 && settings.selected_key < static_cast<int>(path.keys.size());
  Wish(wishes, ImGui::Button("add (K)"), ScriptVerb::kKeyAdd);
  Tooltip("The current camera as a key after the last");
  ImGui::BeginDisabled(!selected);
  ImGui::SameLine();
  Wish(wishes, ImGui::Button("update"), ScriptVerb::kKeyUpdate, {key});
  Tooltip("The selected key becomes the current camera");
  ImGui::SameLine();
  Wish(wishes, ImGui::Button("delete"), ScriptVerb::kKeyDelete, {key});
  ImGui::SameLine();
  if (ImGui::ArrowButton("earlier", ImGuiDir_Up)) wishes.exchange_key = settings.selected_key - 1;
  Tooltip("Changes places with the key before");
  ImGui::SameLine();
  if (ImGui::ArrowButton("later", ImGuiDir_Down)) wishes.exchange_key = settings.selected_key + 1;
  Tooltip("Changes places with the key after");
  ImGui::EndDisabled();
  if (path.keys.empty()) {
    Dim("no keys yet");
    return;
  }
  const float rows = static_cast<float>(std::min<std::size_t>(path.keys.size(), 5));
  ImGui::BeginChild("keys", {0, rows * ImGui::GetTextLineHeightWithSpacing() + 0.5F * unit}, true);
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(path.keys.size()));
  while (clipper.Step())
    for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i) {
      const std::string line = fmt::format("{:3d}   {:7.2f} s", i, path.keys[static_cast<std::size_t>(i)].time_s);
      if (ImGui::Selectable(line.c_str(), i == settings.selected_key)) {
        settings.selected_key = i;
        Wish(wishes, true, ScriptVerb::kKeyJump, {static_cast<double>(i)});
      }
    }
  ImGui::EndChild();
  if (selected) {
    double time_s = path.keys[static_cast<std::size_t>(settings.selected_key)].time_s;
    if (ImGui::InputDouble("time of the key", &time_s, 0, 0, "%.2f s", ImGuiInputTextFlags_EnterReturnsTrue))
      Wish(wishes, true, ScriptVerb::kKeyTime, {key, time_s});
  }
}

void PlaybackControls(const PanelFacts& facts, PanelWishes& wishes) {
  const CameraPath& path = facts.path;
  ImGui::BeginDisabled(path.keys.size() < 2);
  if (ImGui::Button(facts.playing ? "stop" : "play", {5 * ImGui::GetFontSize(), 0})) wishes.play = !facts.playing;
  ImGui::SameLine();
  ImGui::SetNextItemWidth(-1);
  auto t = static_cast<float>(facts.play_s);
  if (ImGui::SliderFloat("##scrub", &t, 0, static_cast<float>(std::max(Duration(path), 0.01)), "%.2f s",
                         ImGuiSliderFlags_AlwaysClamp))
    wishes.scrub_s = static_cast<double>(t);
  double seconds = Duration(path);
  if (ImGui::InputDouble("seconds", &seconds, 0, 0, "%.2f", ImGuiInputTextFlags_EnterReturnsTrue))
    Wish(wishes, true, ScriptVerb::kPathSeconds, {seconds});
  ImGui::EndDisabled();
  double fps = path.fps;
  if (ImGui::InputDouble("frames a second", &fps, 0, 0, "%.3g", ImGuiInputTextFlags_EnterReturnsTrue))
    Wish(wishes, true, ScriptVerb::kPathFps, {fps});
  int size[2] = {path.width_px, path.height_px};
  if (ImGui::InputInt2("size", size, ImGuiInputTextFlags_EnterReturnsTrue))
    Wish(wishes, true, ScriptVerb::kPathSize,
         {1.0 * std::clamp(size[0], 0, kMostVideoSide), 1.0 * std::clamp(size[1], 0, kMostVideoSide)});
  Tooltip("Of the video, pixels; 0: the window's");
}

void Files(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes) {
  ImGui::SetNextItemWidth(-1);
  ImGui::InputTextWithHint("##path file", "path.json", settings.path_file.data(), settings.path_file.size());
  const std::string file = settings.path_file.data();
  Wish(wishes, ImGui::Button("load"), ScriptVerb::kPathLoad, {}, file);
  Tooltip("Our format or nerfstudio's");
  ImGui::BeginDisabled(facts.path.keys.empty());
  ImGui::SameLine();
  Wish(wishes, ImGui::Button("save"), ScriptVerb::kPathSave, {}, file);
  ImGui::SameLine();
  Wish(wishes, ImGui::Button("for nerfstudio"), ScriptVerb::kPathSaveNerfstudio, {}, file);
  Tooltip("Saves its camera path JSON, in this scene's own world frame");
  ImGui::SameLine();
  Wish(wishes, ImGui::Button("clear"), ScriptVerb::kKeysClear);
  ImGui::EndDisabled();
}

void Recording(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes) {
  if (facts.recording) {
    if (facts.recording_live)
      ImGui::Text("%.1f s", facts.recorded);
    else
      ImGui::ProgressBar(static_cast<float>(facts.recorded), ImVec2(-1, 0));
    Wrapped(kDim, facts.recording_to);
    if (facts.recording_live) {
      if (ImGui::Button("finish")) wishes.record = RecordWish::kStop;
      ImGui::SameLine();
    }
    if (ImGui::Button("cancel")) wishes.record = RecordWish::kCancel;
    return;
  }
  ImGui::SetNextItemWidth(-1);
  ImGui::InputTextWithHint("##video file", "video.mp4", settings.video_file.data(), settings.video_file.size());
  ImGui::BeginDisabled(facts.path.keys.size() < 2 || facts.measuring);
  if (ImGui::Button("record the path")) wishes.record = RecordWish::kPath;
  ImGui::EndDisabled();
  Tooltip("At the path's size and the current settings; a file of that name stays, the new one gets a number");
  ImGui::SameLine();
  if (ImGui::Button("record what is seen")) wishes.record = RecordWish::kLive;
}

void WebPage(const PanelFacts& facts, PanelWishes& wishes) {
  ImGui::BeginDisabled(!facts.exporting.empty());
  if (ImGui::Button("export as web page")) wishes.export_page = true;
  ImGui::EndDisabled();
  Tooltip("A page of this scene and proxy that any browser shows: web.html in the scene's folder");
  if (!facts.exporting.empty()) Wrapped(kDim, facts.exporting);
}

}  // namespace

void PathGroups(const PanelFacts& facts, ViewerSettings& settings, PanelWishes& wishes) {
  if (Group(settings, "camera path", false)) {
    Keys(facts, settings, wishes);
    PlaybackControls(facts, wishes);
    Files(facts, settings, wishes);
  }
  if (Group(settings, "recording", facts.recording)) Recording(facts, settings, wishes);
  if (Group(settings, "web page", !facts.exporting.empty())) WebPage(facts, wishes);
}

}  // namespace lumi
