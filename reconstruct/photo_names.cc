#include "reconstruct/photo_names.h"

#include <fmt/format.h>

#include <cstdint>
#include <set>

#include "scene/program/printable.h"

namespace lumi {
namespace {

constexpr std::size_t kMostBytes = 200;  // of a part of a path; names end at 255

std::string Escaped(std::string_view name) {
  std::string plain;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t length = Utf8Length(name, at);
    const auto byte = static_cast<std::uint8_t>(name[at]);
    const bool outer_blank = byte == ' ' && (at == 0 || at + 1 == name.size());
    if (length == 0 || byte < 0x20 || byte == 0x7F || outer_blank)
      plain += fmt::format("={:02X}", byte);
    else
      plain += name.substr(at, length);
    at += std::max<std::size_t>(1, length);
  }
  return plain;
}

// Where the ending of a part begins, its dot included.
std::size_t EndingAt(const std::string& part) {
  constexpr std::size_t kLongestEnding = 10;
  const auto dot = part.rfind('.');
  return dot == std::string::npos || dot == 0 || part.size() - dot > kLongestEnding ? part.size() : dot;
}

std::string Cut(const std::string& part) {
  if (part.size() <= kMostBytes) return part;
  std::uint32_t hash = 2166136261U;  // FNV-1a
  for (const char c : part) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
  const std::string end = fmt::format("={:08x}{}", hash, part.substr(EndingAt(part)));
  std::size_t keep = 0;
  while (true) {  // whole characters
    const std::size_t next = keep + std::max<std::size_t>(1, Utf8Length(part, keep));
    if (next + end.size() > kMostBytes) break;
    keep = next;
  }
  return part.substr(0, keep) + end;
}

std::string SceneName(const std::string& name) {
  const std::string escaped = Escaped(name);
  std::string result;
  for (std::size_t begin = 0; begin <= escaped.size();) {
    const std::size_t slash = std::min(escaped.find('/', begin), escaped.size());
    result += (begin > 0 ? "/" : "") + Cut(escaped.substr(begin, slash - begin));
    begin = slash + 1;
  }
  return result;
}

}  // namespace

std::vector<std::string> SceneNames(const std::vector<std::string>& names) {
  // Photos that keep their names come first.
  std::set<std::string> taken;
  std::vector<std::string> result;
  for (const std::string& name : names) {
    result.push_back(SceneName(name));
    if (result.back() == name) taken.insert(name);
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (result[i] == names[i]) continue;
    const std::string wanted = result[i];
    const auto ending = static_cast<std::ptrdiff_t>(EndingAt(wanted));
    for (int n = 2; !taken.insert(result[i]).second; ++n)
      result[i] = wanted.substr(0, static_cast<std::size_t>(ending)) + fmt::format("={}", n) +
                  wanted.substr(static_cast<std::size_t>(ending));
  }
  return result;
}

}  // namespace lumi
