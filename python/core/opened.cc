#include "python/core/opened.h"

#include "render/radiance/setting_words.h"
#include "render/settings_json.h"
#include "render/show/proxy_picture.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

Show ShowFrom(const std::string& name) {
  if (name == "color") return Show::kColor;
  if (name == "false-color") return Show::kFalseColor;
  if (name == "tessellation") return Show::kTessellation;
  throw UsageError("show takes color, false-color, tessellation or proxy; not " + name,
                   "measure_map gives the values of a measure");
}

}  // namespace

OpenedLumigraph::OpenedLumigraph(const LumigraphOptions& options, const std::string& proxy, const Mesh* mesh,
                                 bool along_matrices, ProgressSink& sink)
    : lumigraph_(options, sink), along_matrices_(along_matrices) {
  lumigraph_.MakePictures(proxy, along_matrices, mesh);
  if (mesh != nullptr && !lumigraph_.one_mesh()) throw UsageError("pictures with a proxy of their own take no mesh");
  lumigraph_.ReadPhotos(sink);
}

std::vector<bool> OpenedLumigraph::Without(const std::vector<std::string>& leave_out) const {
  std::vector<bool> use;
  if (!leave_out.empty()) use.assign(lumigraph_.scene().views.size(), true);
  for (const std::string& name : leave_out) use[static_cast<std::size_t>(ViewCalled(lumigraph_.scene(), name))] = false;
  return use;
}

std::vector<bool> OpenedLumigraph::Use(const RenderView& view, const std::vector<std::string>& leave_out) const {
  return along_matrices_ ? lumigraph_.InWindow(view, Without(leave_out)) : Without(leave_out);
}

void OpenedLumigraph::ChooseMeasures(const std::vector<RenderView>& views, const std::vector<std::string>& leave_out) {
  const std::lock_guard lock(mutex_);
  if (views.empty()) throw UsageError("measures are chosen for some views, and there is none");
  lumigraph_.ChooseMeasures(views, Without(leave_out));
  chosen_ = true;
}

RadianceSettings OpenedLumigraph::SettingsFor(const RenderView& view, const std::vector<bool>& use,
                                              const Words& settings) {
  if (!chosen_) lumigraph_.ChooseMeasures({view}, use);
  // What is found out, or decided, once for all pictures.
  for (const auto& [name, text] : settings)
    if (name == "time-s" || name == "white-balance" || name == "vignetting" || text == "measured")
      throw UsageError(name + " counts for all pictures", "give it to lumigraph.open");
  RadianceSettings s = lumigraph_.settings();
  Decided decided = lumigraph_.decided();
  ApplySettingWords(settings, s, decided);
  if (const std::string problem = Validate(s); !problem.empty()) throw UsageError(problem);
  if (!lumigraph_.metric() && s.resolution == Resolution::kDistance)
    throw UsageError("resolution=distance compares distances, which this scene does not have", "use jacobian");
  return lumigraph_.At(view, s);
}

JsonKeys OpenedLumigraph::Settings() {
  const std::lock_guard lock(mutex_);
  JsonKeys keys = KeysOf(lumigraph_.settings(), lumigraph_.own_times(), "cpu");
  keys.Remove("backend");
  return keys;
}

std::vector<Effect> OpenedLumigraph::Effects() {
  const std::lock_guard lock(mutex_);
  return lumigraph_.effects();
}

Renderer& OpenedLumigraph::RendererOf(const std::string& backend) {
  if (backend != "cpu" && backend != "gl") throw UsageError("backend takes cpu or gl, not " + backend);
  std::unique_ptr<Renderer>& renderer = renderers_[backend];
  if (!renderer) renderer = lumigraph_.NewRenderer(backend == "gl" ? MakeGlRenderer : MakeCpuRenderer);
  return *renderer;
}

std::string OpenedLumigraph::Device(const std::string& backend) {
  const std::lock_guard lock(mutex_);
  return RendererOf(backend).Device();
}

ShownPicture OpenedLumigraph::Render(const RenderView& view, const std::vector<std::string>& leave_out,
                                     const std::string& show, const std::string& backend, const Words& settings) {
  const std::lock_guard lock(mutex_);
  RenderRequest request;
  request.view = view;
  request.use = Use(view, leave_out);
  request.settings = SettingsFor(view, request.use, settings);
  ShownPicture picture;
  const Stopwatch watch;
  if (show == "proxy") {
    const PictureWorld world = lumigraph_.For(view);
    picture.rgba = DrawProxy(world.sources, world.proxy, world.view);
  } else {
    request.show = ShowFrom(show);
    if (backend == "gl") RequireDrawnByGl(request.settings);
    Renderer& renderer = RendererOf(backend);
    picture.rgba = renderer.Render(request);
    picture.samples = renderer.Statistics().samples;
  }
  picture.ms = 1000 * watch.Seconds();
  return picture;
}

ViewWeights OpenedLumigraph::WeightsOf(const RenderView& view, const std::vector<std::string>& leave_out,
                                       const Words& settings) {
  const std::vector<bool> use = Use(view, leave_out);
  const RadianceSettings s = SettingsFor(view, use, settings);
  if (lumigraph_.one_mesh() && !traced_) traced_ = std::make_unique<TracedProxy>(lumigraph_.scene(), lumigraph_.mesh());
  return {lumigraph_, view, use, s, traced_.get()};
}

ViewPlan OpenedLumigraph::Plan(const RenderView& view, const std::vector<std::string>& leave_out,
                               const Words& settings) {
  const std::lock_guard lock(mutex_);
  return WeightsOf(view, leave_out, settings).Plan();
}

WeightsAtRays OpenedLumigraph::At(const RenderView& view, const std::vector<Eigen::Vector2d>& x_px,
                                  const std::vector<std::string>& leave_out, const Words& settings) {
  const std::lock_guard lock(mutex_);
  return WeightsOf(view, leave_out, settings).At(x_px);
}

MeasureMap OpenedLumigraph::MapOf(const RenderView& view, const std::string& measure, const std::string& photo,
                                  const std::vector<std::string>& leave_out, const Words& settings) {
  const std::lock_guard lock(mutex_);
  const auto shown = MeasureFromName(measure);
  if (!shown) {
    std::string names;
    for (const HeatMap& map : HeatMaps()) names += (names.empty() ? "" : ", ") + std::string(map.name);
    throw UsageError("there is no measure " + measure, "those are " + names);
  }
  RenderRequest request;
  request.view = view;
  request.use = Use(view, leave_out);
  request.settings = SettingsFor(view, request.use, settings);
  return lumigraph_.MapOf(request, *shown, photo.empty() ? -1 : ViewCalled(lumigraph_.scene(), photo));
}

}  // namespace lumi
