// Files that an export may replace: those that it made.
#pragma once

#include <filesystem>
#include <string>

namespace lumi {

// Throws UsageError where `file` is a folder, or is there without `mark` among its first bytes. what: "page", "glTF
// file".
void RequireOurFile(const std::filesystem::path& file, const std::string& mark, const std::string& what);

// ... of a folder: is empty, or has `marker` in it. A scene is no output, though this suite made it.
void RequireOurExport(const std::filesystem::path& folder, const std::string& marker);

}  // namespace lumi
