// lumi-render --holdout: photos that are left out, rendered from the others.
#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <utility>
#include <vector>

#include "render/commands/render_job.h"
#include "render/holdout/evaluation_proxy.h"
#include "render/holdout/seen_pixels.h"
#include "scene/files/evaluation_proxy.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

Fold FoldOf(const RenderOptions& o) { return o.fold == "choose" ? Fold::kChoose : Fold::kReport; }

// The proxy that a photo of this run is rendered over.
std::string ProxyOf(const RenderJob& job, ViewId photo) {
  const std::string& name = job.lumigraph.proxy_name();
  return job.lumigraph.one_mesh() ? ProxyFor(job.scene().folder, name, job.options.holdout, photo,
                                             static_cast<int>(job.scene().views.size()))
                                  : name;
}

// One name for the proxies of all held-out photos.
std::string ProxyEvaluated(const RenderJob& job) {
  const std::string first = ProxyOf(job, {0});
  if (job.options.holdout != kHoldoutEach || first == job.lumigraph.proxy_name()) return first;
  return fmt::format("{}-without-each-K-of-{}", job.lumigraph.proxy_name(), kProxiesForEach);
}

// Makes, for each held-out photo, the renderer over its proxy and the mask of its seen pixels. Only one renderer exists
// at a time.
class HeldOutRenderers {
 public:
  explicit HeldOutRenderers(RenderJob& job) : job_(job), proxy_(ProxyOf(job, {0})) {
    const std::string& seen = job.options.seen_proxy;
    if (seen.empty()) return;
    if (!job.lumigraph.metric())
      throw UsageError(
          fmt::format("--seen-proxy names a mesh, which a {} scene does not have", Name(job.scene().frame)));
    seen_.emplace(*WorldOf(job.scene(), LoadProxy(job.scene(), seen)));
  }

  HoldoutRenderer For(ViewId photo) {
    const Lumigraph& lumigraph = job_.lumigraph;
    if (std::string proxy = ProxyOf(job_, photo); proxy != proxy_) {
      if (job_.options.seen_proxy.empty()) seen_.reset();
      job_.renderer.reset();  // before the next one is made: either may be large
      job_.lumigraph.StandIn(LoadProxy(job_.scene(), proxy));
      job_.renderer = job_.NewRenderer();
      proxy_ = std::move(proxy);
    }
    if (!seen_ && lumigraph.one_mesh()) seen_.emplace(*WorldOf(job_.scene(), lumigraph.mesh()));
    return {job_.renderer.get(), [this](const RenderView& view, const std::vector<bool>& use) {
              if (seen_) return seen_->Mask(view, use);
              const PictureWorld own = job_.lumigraph.For(view);  // a proxy of the view's, which hides nothing
              return SeenPixels(own).Mask(own.view, use);
            }};
  }

 private:
  RenderJob& job_;
  std::string proxy_;  // that job_.renderer is over
  std::optional<SeenPixels> seen_;
};

// Removes pictures of an earlier run whose photos this run did not render (another N or fold).
void RemoveOthers(const std::filesystem::path& folder, const std::vector<HoldoutView>& views) {
  if (folder.empty()) return;
  std::set<std::string> made;
  for (const HoldoutView& v : views)
    for (const char* ending : {kRenderEnding, kDifferenceEnding}) made.insert(v.file + ending);
  std::vector<std::filesystem::path> old;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if ((name.ends_with(kRenderEnding) || name.ends_with(kDifferenceEnding)) && !made.contains(name))
      old.push_back(it->path());
  }
  for (const std::filesystem::path& file : old) std::filesystem::remove(file, error);
}

}  // namespace

void TakeEvaluationProxy(RenderJob& job) {
  const std::string proxy = ProxyOf(job, {0});
  if (proxy == job.lumigraph.proxy_name()) {
    if (!job.lumigraph.one_mesh()) return;
    const std::string remark = RemarkOnProxyThatSaw(job.scene().folder, proxy, job.options.holdout);
    if (!remark.empty()) job.sink.Message(remark);
    return;
  }
  job.lumigraph.StandIn(LoadProxy(job.scene(), proxy));
  job.sink.Message(fmt::format("held-out photos are rendered over {}, made without them, in place of {}",
                               ProxyEvaluated(job), job.lumigraph.proxy_name()));
}

DesiredViews HeldOutWanted(const RenderJob& job) {
  return LeaveOut(job.scene(), job.options.holdout, FoldOf(job.options), job.options.width_px);
}

void RenderHeldOut(RenderJob& job) {
  HoldoutOptions h;
  h.n = job.options.holdout;
  h.fold = FoldOf(job.options);
  h.width_px = job.options.width_px;
  h.settings = job.lumigraph.settings();
  h.own_times = job.lumigraph.own_times();
  h.folder = job.options.output;
  HeldOutRenderers renderers(job);
  MarkOutput(job);
  RenderSummary& s = job.summary;
  s.holdout = {h.n, h.n == kHoldoutEach ? std::string() : job.options.fold, ProxyEvaluated(job), job.options.seen_proxy,
               EvaluateHoldout(
                   job.scene(), [&](ViewId photo) { return renderers.For(photo); }, h, job.sink)};
  const HoldoutSummary& errors = s.holdout->errors;
  RemoveOthers(h.folder, errors.views);
  s.frames = static_cast<long>(errors.views.size());
  s.ms_per_frame = errors.ms_per_frame;
  s.coverage = errors.mean.coverage;
  s.samples = errors.samples;
  s.wrote = h.folder;
  s.optimum = errors.optimum;
  job.most_halved = errors.halved;
}

}  // namespace lumi
