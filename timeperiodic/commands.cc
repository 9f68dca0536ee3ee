#include "timeperiodic/commands.h"

#include <fmt/format.h>

#include <chrono>

#include "scene/files/atomic_file.h"
#include "scene/files/svg_file.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "scene/tradeoff/table.h"
#include "timeperiodic/frame_stack.h"
#include "timeperiodic/period_plot.h"
#include "timeperiodic/period_tradeoff.h"

namespace lumi {
PeriodSummary RunPeriod(const PeriodCommandOptions& o, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  if (!o.frames.empty() && o.frames.size() != 2) throw UsageError("--frames takes two frame numbers");
  if (o.frames.empty() != (o.count == 0)) throw UsageError("--frames A B and --count N go together");
  if (!o.frames.empty() && !o.tradeoff.empty())
    throw UsageError("--tradeoff measures a search: it does not go with --frames");
  if (o.true_period_frames && o.tradeoff.empty()) throw UsageError("--true-period goes with --tradeoff");
  RequireSvgFile(o.plot);
  FrameStackOptions reading;
  reading.max_width_px = o.width_px;
  const FrameStack stack = ReadFrameStack(o.video, reading, progress);
  if (stack.uneven)
    progress.Message(
        fmt::format("{}: frames are unevenly spaced in time; periods are in frames of {:.4g} ms, the usual "
                    "step",
                    o.video.filename().string(), 1000 / stack.fps));
  PeriodEstimate e;
  if (!o.frames.empty()) {
    for (const int f : o.frames)
      if (f < 0 || f >= stack.count())
        throw UsageError(fmt::format("--frames: there is no frame {}, the video has {} (0 to {})", f, stack.count(),
                                     stack.count() - 1));
    e = CountedPeriod(o.frames[0], o.frames[1], o.count, stack.time);
  } else {
    e = PeriodOfVideo(stack, o.moving, o.period, progress);
  }
  for (const std::string& w : e.warnings) progress.Message(w);
  if (!o.plot.empty()) WriteTextAtomically(o.plot, PeriodPlot(e));
  PeriodSummary summary{e, stack.fps, stack.count(), stack.count() / e.period_frames, 0, {}};
  if (!o.tradeoff.empty()) {
    PeriodTradeoff& t = summary.tradeoff.emplace();
    t.table = MeasurePeriodTradeoff({o.video, o.moving, o.period, o.width_px, o.true_period_frames}, {}, progress);
    t.files = WritePeriodTradeoff(o.tradeoff, t.table);
  }
  summary.seconds = SecondsSince(start);
  return summary;
}

}  // namespace lumi
