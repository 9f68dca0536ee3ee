// --leave-out each: the proxies that `lumi-render --holdout each` renders over.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>

#include "proxy/commands.h"
#include "proxy/make_proxy.h"
#include "scene/files/evaluation_proxy.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {

int LeaveOutFrom(const std::string& text) {
  if (text == "each") return kLeaveOutEach;
  int n = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), n);
  if (error != std::errc() || end != text.data() + text.size() || n < 2)
    throw UsageError("takes a whole number N of 2 or more, or each; not " + text);
  return n;
}

EachSummary RunForEach(const ProxyTarget& target, ProgressSink& progress,
                       const std::function<ProxySummary(const ProxyTarget&)>& make) {
  const auto start = std::chrono::steady_clock::now();
  if (target.keep_choosing_fold)
    throw UsageError("--keep-choosing-fold goes with --leave-out N: nothing is chosen on a fold of each");
  if (!target.output.empty())
    throw UsageError("--leave-out each makes several proxies, and --output names one file",
                     "leave --output out: they are kept in the scene, as NAME-without-each-K-of-5");
  if (target.activate) throw UsageError("--activate and --leave-out each exclude each other");
  EachSummary summary;
  summary.name = target.name;
  // Of fewer photos than there are folds, each has a proxy of its own.
  const auto photos = static_cast<int>(OpenForProxy(target.scene, progress).views.size());
  const int count = std::min(kProxiesForEach, photos);
  progress.Message(fmt::format("{} proxies are made, each without one photo in {}: about {} times as long as one takes",
                               count, count, count));
  for (int k = 0; k < count; ++k) {
    ProxyTarget fold = target;
    fold.leave_out = kLeaveOutEach;
    fold.fold = k;
    progress.Message(fmt::format("{} ({} of {})", StoredName(fold), k + 1, count));
    summary.proxies.push_back(make(fold));
  }
  summary.seconds = SecondsSince(start);
  return summary;
}

void ListKeys(JsonKeys& j, EachSummary& s) { j("name", s.name, "proxies", s.proxies, "seconds", s.seconds); }

std::string Describe(const EachSummary& s) {
  std::string out;
  for (const ProxySummary& p : s.proxies) out += Describe(p) + "\n";
  return out + fmt::format("for lumi-render --holdout each --proxy {}; {:.1f} s", s.name, s.seconds);
}

}  // namespace lumi
