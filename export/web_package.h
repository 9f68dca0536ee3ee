// A page as one file that opens from disk, or as a folder for any web server.
#pragma once

#include <filesystem>

#include "export/web_manifest.h"

namespace lumi {

// What a byte of a part becomes in one file (base64).
constexpr double kBytesInOneFile = 4.0 / 3;
// The file that marks a folder as an export of ours.
constexpr const char* kWebMarker = ".lumigraph-web";

// Throws UsageError where there is something that no earlier export wrote: nothing is touched.
void RequireOurOutput(const std::filesystem::path& output, bool one_file);

// Bytes written. Both replace what an earlier export wrote.
double WriteOneFile(const WebPage& page, const std::filesystem::path& file);
double WriteWebFolder(const WebPage& page, const std::filesystem::path& folder);

}  // namespace lumi
