// lumi-render --holdout: photos that are left out, rendered from the others.
#include "render/commands/render_job.h"

namespace lumi {
namespace {

Fold FoldOf(const RenderOptions& o) { return o.fold == "choose" ? Fold::kChoose : Fold::kReport; }

}  // namespace

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
  RenderSummary& s = job.summary;
  s.holdout = {h.n, job.options.fold, EvaluateHoldout(job.scene(), *job.renderer, h, job.sink)};
  const HoldoutSummary& errors = s.holdout->errors;
  s.frames = static_cast<long>(errors.views.size());
  s.ms_per_frame = errors.ms_per_frame;
  s.coverage = errors.mean.coverage;
  s.samples = errors.samples;
  s.optimum = errors.optimum;
}

}  // namespace lumi
