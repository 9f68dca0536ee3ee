// What lumi-render does with a scene: a path, one view, or the held-out photos, as pictures, a video and figures.
#pragma once

#include "render/commands/render_options.h"
#include "render/commands/render_summary.h"
#include "scene/program/progress.h"

namespace lumi {

// Throws UsageError for what does not fit together.
RenderSummary RunRender(const RenderOptions& options, ProgressSink& progress);

}  // namespace lumi
