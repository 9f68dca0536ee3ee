// Files that an export may replace: those that it made.
#pragma once

#include <filesystem>
#include <string>

namespace lumi {

// Throws UsageError if `file` is a folder, or exists without `mark` among its first bytes. what: its name in the
// message, "page" or "glTF file".
void RequireOurFile(const std::filesystem::path& file, const std::string& mark, const std::string& what);

// The same for a folder, which must be new, empty, or hold the file `marker`. A scene without `marker` is refused: this
// suite made it, but not as an export.
void RequireOurExport(const std::filesystem::path& folder, const std::string& marker);

}  // namespace lumi
