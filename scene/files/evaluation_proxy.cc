#include "scene/files/evaluation_proxy.h"

#include <fmt/format.h>

#include <algorithm>

namespace lumi {
namespace {

constexpr std::string_view kWithout = "-without-";

bool IsCount(std::string_view text) {
  return !text.empty() && text.front() != '0' && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::string ProxyWithout(const std::string& name, int n) { return fmt::format("{}{}{}", name, kWithout, n); }

std::string ProxyWithoutEach(const std::string& name, int k) {
  return fmt::format("{}{}each-{}-of-{}", name, kWithout, k, kProxiesForEach);
}

bool IsForEvaluation(std::string_view name) {
  const std::size_t at = name.rfind(kWithout);
  if (at == std::string_view::npos || at == 0) return false;
  const std::string of(name.substr(0, at));
  for (int k = 0; k < kProxiesForEach; ++k)
    if (name == ProxyWithoutEach(of, k)) return true;
  const std::string_view n = name.substr(at + kWithout.size());
  return IsCount(n) && n != "1";
}

}  // namespace lumi
