#include "render/tradeoff/workbench.h"

#include <fmt/format.h>

#include <algorithm>

#include "render/comparators/comparators.h"
#include "render/holdout/evaluation_proxy.h"
#include "render/holdout/holdout.h"
#include "render/tradeoff/sweep.h"
#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr int kLargestWidth = 1024, kQuickWidth = 320;
constexpr double kReferenceCutoffDeg = 24;

}  // namespace

void RequireConsistent(const MeasureOptions& o) {
  if (const std::string problem = Validate(o.settings); !problem.empty()) throw UsageError(problem);
  if (const std::string problem = ProblemOf(o.settings); !problem.empty()) throw UsageError(problem);
  if (o.holdout < 2) throw UsageError("--holdout takes 2 or more");
  if (o.views < 1) throw UsageError("--views takes 1 or more");
  if (o.repeats < 1 || o.repeats > 1000) throw UsageError("--repeats takes 1 to 1000");
  if (o.width_px < 0 || o.width_px > kMaxPictureSide || o.reference_width_px < 0 ||
      o.reference_width_px > kMaxPictureSide)
    throw UsageError("--width and --reference-width take 1 to " + std::to_string(kMaxPictureSide));
  if (!o.view.empty() && !o.path.empty()) throw UsageError("--view and --path do not go together");
  for (std::size_t i = 0; i < o.proxies.size(); ++i)
    if (std::find(o.proxies.begin(), o.proxies.begin() + static_cast<std::ptrdiff_t>(i), o.proxies[i]) !=
        o.proxies.begin() + static_cast<std::ptrdiff_t>(i))
      throw UsageError("--proxy " + o.proxies[i] + " is given twice");
  RadianceSettings settings = o.settings;
  Decided decided = o.decided;
  ApplyEffectList(o.effects, settings, decided);
}

namespace {

const MeasureOptions& Checked(const MeasureOptions& o, const std::string& marker) {
  RequireConsistent(o);
  if (!o.output.empty()) RequireOurFolder(o.output, marker);
  return o;
}

}  // namespace

Workbench::Workbench(const MeasureOptions& o, const std::string& marker, ProgressSink& sink)
    : o_(Checked(o, marker)), lumigraph_(o, sink), proxies_(o.proxies) {
  RequireMetric(scene(), "rendering");
  if (proxies_.empty()) {
    proxies_ = ListProxies(scene().folder);
    std::stable_partition(proxies_.begin(), proxies_.end(),
                          [&](const std::string& p) { return p == scene().active_proxy; });
    if (proxies_.empty()) proxies_ = {""};  // LoadProxy says what is missing
  }
  lumigraph_.MakePictures(proxies_.front(), false);
  if (const std::string& name = lumigraph_.proxy_name(); lumigraph_.one_mesh())
    if (const std::string evaluated = Evaluated(name, sink); evaluated != name)
      lumigraph_.StandIn(LoadProxy(scene(), evaluated));
  for (std::size_t i = 1; i < proxies_.size(); ++i)
    meshes_[proxies_[i]] = LoadProxy(scene(), Evaluated(proxies_[i], sink));
  lumigraph_.ReadPhotos(sink);
  const DesiredViews desired = LeaveOut(scene(), o.holdout, Fold::kReport, Width());
  lumigraph_.ChooseMeasures(desired.views, desired.use);
}

std::string Workbench::Evaluated(const std::string& proxy, ProgressSink& sink) {
  if (!o_.view.empty()) return proxy;
  // Only the choosing fold may be empty: the reporting fold always holds the first photo.
  const int n = HoldoutWithPhotos(scene(), o_.holdout, Fold::kChoose);
  const std::string evaluated = ProxyFor(scene().folder, proxy, n, {0});
  if (evaluated == proxy) {
    const std::string remark = RemarkOnProxyThatSaw(scene().folder, proxy, n);
    if (!remark.empty()) sink.Message(remark);
    return proxy;
  }
  evaluated_[proxy] = evaluated;
  sink.Message(
      fmt::format("held-out photos are rendered over {}, made without them, in place of {}", evaluated, proxy));
  return evaluated;
}

const Mesh& Workbench::mesh(const std::string& proxy) const {
  return proxy == proxies_.front() ? lumigraph_.mesh() : meshes_.at(proxy);
}

Renderer& Workbench::Cpu(const std::string& proxy) {
  auto& r = cpu_[proxy];
  if (!r) r = lumigraph_.NewRenderer(MakeCpuRenderer, mesh(proxy));
  return *r;
}

Renderer& Workbench::Measured(const std::string& proxy) {
  if (o_.backend != "gl") return Cpu(proxy);
  auto& r = gl_[proxy];
  if (!r) r = lumigraph_.NewRenderer(MakeGlRenderer, mesh(proxy));
  return *r;
}

void Workbench::Drop(const std::string& proxy) {
  cpu_.erase(proxy);
  gl_.erase(proxy);
}

int Workbench::Width() const {
  int widest = 1;
  for (const View& v : scene().views) widest = std::max(widest, scene().CameraOf(v).width_px);
  const int most = std::min(widest, o_.quick ? kQuickWidth : kLargestWidth);
  return o_.width_px > 0 ? std::min(o_.width_px, widest) : most;
}

bool Workbench::MayWriteScene() const {
  std::error_code ec;
  return std::filesystem::exists(scene().folder / "lumigraph.json", ec);
}

RadianceSettings ReferenceSettings(const RadianceSettings& base) {
  RadianceSettings s = WithMethod(base, Method::kOptimumPixel);
  s.cutoff_rad = kReferenceCutoffDeg * kRadPerDeg;
  return s;
}

}  // namespace lumi
