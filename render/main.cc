#include <map>
#include <nlohmann/json.hpp>

#include "render/render_command.h"
#include "render/settings_json.h"
#include "scene/files/atomic_file.h"
#include "scene/program/main_program.h"

namespace {

// Options of the reconstruction as they stand on the command line.
using Given = std::map<std::string, std::string>;

// Defaults, then the file's own words, then the command line's.
void ApplySettings(const std::filesystem::path& file, const Given& given, lumi::RenderOptions& options) {
  if (!file.empty()) {
    try {
      nlohmann::ordered_json j = nlohmann::ordered_json::parse(lumi::ReadText(file));
      if (j.contains("settings")) j = j["settings"];
      for (const auto& [name, value] : j.items()) {
        if (name == "backend")
          options.backend = value.get<std::string>();
        else if (lumi::SetOption(options.settings, name, value))
          options.decided.insert(name);
        else
          throw lumi::InputError(file, "\"" + name + "\" is not a setting of the reconstruction");
      }
    } catch (const nlohmann::json::exception& e) {
      throw lumi::InputError(file, std::string("not a settings file: ") + e.what());
    } catch (const lumi::UsageError& e) {
      throw lumi::InputError(file, e.what());
    }
  }
  for (const auto& [name, value] : given)
    if (!value.empty()) {
      lumi::SetOption(options.settings, name, value);
      options.decided.insert(name);
    }
  // Who names a time wants it to count.
  if ((!given.at("time-s").empty() || options.phase) && given.at("time").empty()) {
    options.settings.time = true;
    options.decided.insert("time");
  }
  // What the optimum needs and nobody spoke against: 1/h is no covariance, and candidates are weighed one by one.
  if (options.settings.similarity == lumi::Similarity::kFull) {
    if (given.at("correlation").empty()) options.settings.correlation = lumi::Correlation::kFallingLeaves;
    if (given.at("sampling").empty()) options.settings.sampling = lumi::Sampling::kInterpolated;
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
  app.add_option("--show", o.show, "What is shown")->check(CLI::IsMember(lumi::ShowNames()))->capture_default_str();
  app.add_option("--of", o.of, "With --show weights, angle ...: of this photo; default: of the one that weighs most");
  app.add_option("--effects", o.effects, "auto: what the data call for; none; or a list of fov, resolution, visibility, time, exposure, prefilter")->capture_default_str();
  app.add_option("--phase", o.phase, "The view's time as a fraction of the scene's period");
  std::filesystem::path settings_file;
  Given given;
  for (const lumi::SettingOption& s : lumi::SettingOptions())
    app.add_option("--" + s.name, given[s.name], s.help)->type_name(s.value)->default_str(s.fallback)->group("Reconstruction");
  app.add_option("--settings", settings_file, "JSON object of the reconstruction's options; what stands on the command line wins");
  app.add_flag("--rescale-cameras", o.rescale_cameras, "Fit cameras to photos of another size instead of refusing them");
  return program.Run(
      argc, argv,
      [&] {
        if (o.output.empty() && o.holdout == 0) throw lumi::UsageError("-o says where the pictures go");
        const std::string backend = o.backend;
        ApplySettings(settings_file, given, o);
        if (app.get_option("--backend")->count() > 0) o.backend = backend;
        return lumi::RunRender(o, program.progress());
      },
      lumi::DescribeRender);
}
