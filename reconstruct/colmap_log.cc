#include "reconstruct/colmap_log.h"

#include <cctype>
#include <string_view>
#include <vector>

namespace lumi {
namespace {

// The whole numbers of a text, in order.
std::vector<long> Numbers(std::string_view text) {
  std::vector<long> numbers;
  for (std::size_t i = 0; i < text.size();) {
    if (!std::isdigit(static_cast<unsigned char>(text[i]))) {
      ++i;
      continue;
    }
    long value = 0;
    for (int digits = 0; i < text.size() && std::isdigit(static_cast<unsigned char>(text[i])); ++i, ++digits)
      if (digits < 15) value = value * 10 + (text[i] - '0');
    numbers.push_back(value);
  }
  return numbers;
}

// The text between the brackets that follow `phrase`.
std::optional<std::string_view> Bracketed(std::string_view line, std::string_view phrase) {
  const auto at = line.find(phrase);
  if (at == std::string_view::npos) return std::nullopt;
  const auto open = line.find('[', at + phrase.size());
  const auto close = line.find(']', at + phrase.size());
  if (open == std::string_view::npos || close == std::string_view::npos || close < open) return std::nullopt;
  return line.substr(open + 1, close - open - 1);
}

}  // namespace

std::optional<ColmapProgressLine> ParseColmapProgress(const std::string& line) {
  for (const char* phrase : {"Processed file", "Matching image", "Processing image", "Undistorting image"}) {
    if (const auto inside = Bracketed(line, phrase)) {
      const auto n = Numbers(*inside);
      if (n.size() == 2 && n[1] > 0 && n[0] <= n[1]) return ColmapProgressLine{n[0], n[1]};
    }
  }
  for (const char* phrase : {"Matching block", "Processing block"}) {
    if (const auto inside = Bracketed(line, phrase)) {
      const auto n = Numbers(*inside);  // [row/rows, column/columns]
      if (n.size() == 4 && n[0] >= 1 && n[0] <= n[1] && n[2] >= 1 && n[2] <= n[3])
        return ColmapProgressLine{(n[0] - 1) * n[3] + n[2], n[1] * n[3]};
      if (n.size() == 2 && n[1] > 0 && n[0] <= n[1]) return ColmapProgressLine{n[0], n[1]};  // of a list of pairs
    }
  }
  if (const auto at = line.find("Registering image #"); at != std::string::npos) {
    const auto open = line.find('(', at);
    if (open == std::string::npos) return std::nullopt;
    const auto n = Numbers(std::string_view(line).substr(open));
    if (!n.empty()) return ColmapProgressLine{n[0], 0};
  }
  return std::nullopt;
}

}  // namespace lumi
