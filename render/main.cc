#include <nlohmann/json.hpp>

#include "render/render_command.h"
#include "scene/files/atomic_file.h"
#include "scene/program/main_program.h"

namespace {

// An object of this program's own option names and values; what stands on the command line wins.
void ApplySettings(const std::filesystem::path& file, CLI::App& app, lumi::RenderOptions& options) {
  nlohmann::json j;
  try {
    j = nlohmann::json::parse(lumi::ReadText(file));
    if (j.contains("settings")) j = j["settings"];
    for (const auto& [name, value] : j.items()) {
      CLI::Option* option = app.get_option_no_throw("--" + name);
      if (!option) throw lumi::InputError(file, "unknown setting \"" + name + "\"");
      if (option->count() > 0) continue;
      if (name == "k") options.k = value.is_number() ? std::to_string(value.get<int>()) : value.get<std::string>();
      else if (name == "gamma") options.gamma = value.get<double>();
      else if (name == "fov-feather") options.fov_feather = value.get<double>();
      else if (name == "visibility") options.visibility = value.get<bool>();
      else if (name == "prefilter") options.prefilter = value.get<bool>();
      else if (name == "backend") options.backend = value.get<std::string>();
      else throw lumi::InputError(file, "\"" + name + "\" is not a setting of the reconstruction");
    }
  } catch (const nlohmann::json::exception& e) {
    throw lumi::InputError(file, std::string("not a settings file: ") + e.what());
  }
}

}  // namespace

int main(int argc, char** argv) {
  lumi::Program program("lumi-render", "Renders an unstructured lumigraph: a camera path, a photo's own view, or held-out photos");
  lumi::RenderOptions o;
  CLI::App& app = program.app();
  app.add_option("scene", o.scene, "Scene folder, COLMAP workspace or transforms.json")->required();
  app.add_option("-o,--output", o.output, "Folder for pictures, or FILE.mp4 for a path");
  app.add_option("--proxy", o.proxy, "Proxy by name; default: the scene's active one");
  app.add_option("--path", o.path, "Camera path JSON; default: through the photos' own cameras");
  app.add_option("--view", o.view, "Render at this photo's own camera");
  app.add_flag("--leave-out", o.leave_out, "With --view: without that photo");
  app.add_option("--holdout", o.holdout, "Render photos 0, N, 2N ... from the others and compare (N >= 2)");
  app.add_option("--fold", o.fold, "Photos that --holdout takes: report 0, N ..., choose N/2, N/2+N ...")->check(CLI::IsMember({"report", "choose"}))->capture_default_str();
  app.add_option("--width", o.width_px, "Width in pixels; default: the photo's, or at most 1024 for a path");
  app.add_option("--height", o.height_px, "Height in pixels; default: by the photos' aspect");
  app.add_option("--seconds", o.seconds, "Length of the path through the photos")->capture_default_str();
  app.add_option("--fps", o.fps, "Frames a second of that path")->capture_default_str();
  app.add_flag("--video", o.video, "Also write the path as path.mp4 (H.264)");
  app.add_option("--format", o.format, "Of the pictures")->check(CLI::IsMember({"png", "jpg", "exr"}))->capture_default_str();
  app.add_option("--backend", o.backend, "Where frames are blended")->check(CLI::IsMember({"cpu", "gl"}))->capture_default_str();
  app.add_option("--show", o.show, "What is shown")->check(CLI::IsMember({"color", "false-color", "difference"}))->capture_default_str();
  app.add_option("--k", o.k, "Photos blended at a pixel: 1 to 16, or all")->capture_default_str();
  app.add_option("--gamma", o.gamma, "Weight of the field-of-view penalty, >= 0")->capture_default_str();
  app.add_option("--fov-feather", o.fov_feather, "Border over which a photo fades, fraction of its smaller side, (0, 0.5]")->capture_default_str();
  app.add_flag("--visibility,!--no-visibility", o.visibility, "Photos whose view of a point the proxy blocks rank last")->default_str("on");
  app.add_flag("--prefilter,!--no-prefilter", o.prefilter, "Read oversampled photos from their pyramid")->default_str("on");
  app.add_option("--settings", o.settings_file, "JSON object of the options above");
  app.add_flag("--rescale-cameras", o.rescale_cameras, "Fit cameras to photos of another size instead of refusing them");
  return program.Run(
      argc, argv,
      [&] {
        if (o.output.empty() && o.holdout == 0) throw lumi::UsageError("-o says where the pictures go");
        if (!o.settings_file.empty()) ApplySettings(o.settings_file, app, o);
        return lumi::RunRender(o, program.progress());
      },
      lumi::DescribeRender);
}
