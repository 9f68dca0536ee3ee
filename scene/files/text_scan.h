// Reading numbers and words out of a text in memory, for the text formats here (PLY, OBJ, COLMAP's .txt). Inside
// scene/files only.
#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string_view>

namespace lumi::text_scan {

inline bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

inline std::string_view Trim(std::string_view s) {
  while (!s.empty() && IsBlank(s.front())) s.remove_prefix(1);
  while (!s.empty() && IsBlank(s.back())) s.remove_suffix(1);
  return s;
}

// The next line without its end; false at the end of the text.
inline bool NextLine(std::string_view& text, std::string_view& line) {
  if (text.empty()) return false;
  const std::size_t end = text.find('\n');
  line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return true;
}

// The next word of a line (blanks and, in a text, line ends separate); empty at the end.
inline std::string_view NextWord(std::string_view& text) {
  const auto separates = [](char c) { return IsBlank(c) || c == '\n'; };
  while (!text.empty() && separates(text.front())) text.remove_prefix(1);
  std::size_t n = 0;
  while (n < text.size() && !separates(text[n])) ++n;
  const std::string_view word = text.substr(0, n);
  text.remove_prefix(n);
  return word;
}

// The whole word as a number (locale does not matter; "nan" and "inf" are numbers here, the caller judges).
template <typename T>
std::optional<T> ToNumber(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || word.empty()) return std::nullopt;
  return value;
}

template <typename T>
std::optional<T> NextNumber(std::string_view& text) {
  return ToNumber<T>(NextWord(text));
}

}  // namespace lumi::text_scan
