// The suite's version, the one place where it stands (CMakeLists.txt reads it from here).
#pragma once

namespace lumi {

inline constexpr const char* kVersion = "0.1.0";

}  // namespace lumi
