// The names of proxies for an evaluation: each stands for a proxy NAME and was made without looking at photos that are
// rendered over it (no depth of theirs, no point that needs them). They lie beside NAME in SCENE/proxies, and are no
// proxies of their own: ListProxies leaves them out.
//
//   NAME-without-N          without photos 0, N, 2N ... (in the order of names), which quality is reported on, and
//                           without photos N/2, N/2 + N ..., which things are chosen on
//   NAME-without-each-K-of-5   without photos K, K + 5, K + 10 ...
#pragma once

#include <string>
#include <string_view>

namespace lumi {

// --holdout each leaves every photo out in turn; proxies are made anew so many times, each without every fifth photo.
constexpr int kProxiesForEach = 5;

std::string ProxyWithout(const std::string& name, int n);      // n >= 2
std::string ProxyWithoutEach(const std::string& name, int k);  // k in [0, kProxiesForEach)
bool IsForEvaluation(std::string_view name);

}  // namespace lumi
