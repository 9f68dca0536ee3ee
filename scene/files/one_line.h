// What libraries say may have several lines; our messages have one.
#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace lumi {

inline std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  return text;
}

}  // namespace lumi
