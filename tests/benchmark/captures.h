// What the quoted figures are measured on: a simulated desk always, real captures where their folder is given.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace lumi {

struct BenchCapture {
  std::string name;
  std::filesystem::path photos;
  std::filesystem::path truth;  // see ReadTruePoses; empty: none is known
};

// `data` may be empty; captures that are not in it are left out.
std::vector<BenchCapture> BenchCaptures(const std::filesystem::path& data, const std::filesystem::path& simulated_desk);

}  // namespace lumi
