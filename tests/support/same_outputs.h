// Whether two runs wrote the same: byte for byte but for how long they took.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace lumi {

// A file's bytes; none where it cannot be read.
std::string WholeFile(const std::filesystem::path& file);

// What each file below a folder holds, by its path in it, as a hash; times in JSON are left out (and hashes of files
// that hold times). Not among them: hidden files, reports in HTML, records of time, LOCK, and COLMAP's working folder.
std::map<std::string, std::string> ComparableFiles(const std::filesystem::path& folder);

// All that is below a folder, empty folders too, compared as above: where the state is the same, the next run does the
// same. Which process left a temporary or a LOCK is left out.
std::map<std::string, std::string> WholeState(const std::filesystem::path& folder);

// The first difference in words; empty where there is none.
std::string FirstDifference(const std::map<std::string, std::string>& wanted,
                            const std::map<std::string, std::string>& found);

// Temporaries below a folder: what a run that has ended must not leave.
std::string TemporariesIn(const std::filesystem::path& folder);

}  // namespace lumi
