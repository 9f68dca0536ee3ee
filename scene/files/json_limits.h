// What a JSON text may hold before anybody parses it. Trees are copied, printed and freed level by level, on the stack:
// a megabyte of brackets would overflow it. And objects that keep the order of their keys are searched key by key: a
// million of them in one object would take hours.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace lumi {

constexpr std::size_t kDeepestJson = 256;     // levels of brackets
constexpr std::size_t kMostJsonKeys = 20000;  // in one object

// What is beyond these limits, or nullptr. Says nothing of a text that is no JSON; comments are passed over.
const char* JsonBeyondLimits(std::string_view text);

// As ReadText. Throws InputError where the text is beyond the limits.
std::string ReadJsonText(const std::filesystem::path& path, std::size_t max_bytes = std::size_t(1) << 30);

}  // namespace lumi
