#include "scene/files/json_limits.h"

#include <array>

#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {

const char* JsonBeyondLimits(std::string_view text) {
  std::array<std::size_t, kDeepestJson> keys{};  // so far, a level
  std::size_t depth = 0;
  const auto skip_to = [&](std::size_t from, std::string_view end) {
    const std::size_t found = text.find(end, from);
    return found == std::string_view::npos ? text.size() : found + end.size() - 1;
  };
  for (std::size_t i = 0; i < text.size(); ++i) switch (text[i]) {
      case '"':
        for (++i; i < text.size() && text[i] != '"'; ++i)
          if (text[i] == '\\') ++i;
        break;
      case '/': {
        const char next = i + 1 < text.size() ? text[i + 1] : '\0';
        if (next == '/') i = skip_to(i, "\n");
        if (next == '*') i = skip_to(i + 2, "*/");
        break;
      }
      case '[':
      case '{':
        if (depth == kDeepestJson) return "is nested too deeply for JSON of ours";
        keys[depth++] = 0;
        break;
      case ']':
      case '}':
        if (depth > 0) --depth;
        break;
      case ':':
        if (depth > 0 && ++keys[depth - 1] > kMostJsonKeys) return "has too many keys in one object for JSON of ours";
        break;
      default: break;
    }
  return nullptr;
}

std::string ReadJsonText(const std::filesystem::path& path, std::size_t max_bytes) {
  std::string text = ReadText(path, max_bytes);
  if (const char* wrong = JsonBeyondLimits(text)) throw InputError(path, wrong);
  return text;
}

}  // namespace lumi
