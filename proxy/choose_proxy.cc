#include "proxy/choose_proxy.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace lumi {
namespace {

double Score(const ProxyCandidate& c) { return c.psnr_object_db ? *c.psnr_object_db : *c.psnr_db; }

// nullptr where there is none.
const ProxyCandidate* BestOf(const std::vector<const ProxyCandidate*>& candidates) {
  const ProxyCandidate* best = nullptr;
  for (const ProxyCandidate* c : candidates) {
    const double ahead = best ? Score(*c) - Score(*best) : 1;
    if (ahead > 0 || (ahead == 0 && c->faces < best->faces)) best = c;
  }
  if (!best || best->psnr_object_db) return best;
  const double least = Score(*best) - kSamePsnrDb;
  for (const ProxyCandidate* c : candidates)
    if (Score(*c) >= least && c->ssim && best->ssim && *c->ssim > *best->ssim) best = c;
  return best;
}

}  // namespace

std::pair<const ProxyCandidate*, std::string> ChooseProxy(const AutoTable& table, std::optional<double> budget_ms) {
  std::vector<const ProxyCandidate*> affordable;
  const ProxyCandidate* fastest = nullptr;
  const ProxyCandidate* last = nullptr;
  std::size_t made = 0, measured = 0;
  for (const ProxyCandidate& c : table.candidates) {
    if (!c.refused.empty()) continue;
    ++made;
    if (!last || last->name != "delaunay") last = &c;
    if (!c.psnr_db) continue;
    ++measured;
    if (!fastest || *c.ms < *fastest->ms) fastest = &c;
    if (!budget_ms || *c.ms <= *budget_ms) affordable.push_back(&c);
  }
  // Nothing to go by: what goes through the points, or the last that there is, which is the most elaborate.
  if (measured == 0) return {last, made == 1 ? "the only one that can be made" : table.unmeasured};
  const ProxyCandidate* best = BestOf(affordable);
  if (!best) return {fastest, fmt::format("none is within {:g} ms a frame: the fastest", *budget_ms)};
  std::string reason =
      measured == 1 && made == 1 ? "the only one that can be made" : "the smallest error on " + table.fold;
  if (budget_ms) reason += fmt::format(" within {:g} ms a frame", *budget_ms);
  return {best, reason};
}

}  // namespace lumi
