#include "scene/files/json_problem.h"

namespace lumi {

std::string JsonProblem(std::string what) {
  if (const auto bracket = what.find("] "); what.starts_with("[json.exception") && bracket != std::string::npos)
    what.erase(0, bracket + 2);
  const auto between = [&](const std::string& begin, const std::string& end) -> std::string {
    const auto a = what.find(begin);
    const auto b = a == std::string::npos ? a : what.find(end, a + begin.size());
    return b == std::string::npos ? std::string() : what.substr(a + begin.size(), b - a - begin.size());
  };
  if (const std::string key = between("key '", "' not found"); !key.empty())
    return "the key \"" + key + "\" is missing";
  if (const std::string wanted = between("type must be ", ", but is "); !wanted.empty())
    return "a value must be of type " + wanted + ", not" + what.substr(what.find(", but is ") + 8);
  constexpr std::string_view kParse = "parse error at ";
  if (what.starts_with(kParse)) return "no valid JSON: " + what.substr(kParse.size());
  return what;
}

}  // namespace lumi
