#include <cmath>

#include "scene/files/matrix_path.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(matrix_path) {
  const std::filesystem::path file = InputFile("path.json", bytes);
  static_cast<void>(IsMatrixPath(file));
  const MatrixPath path = ReadMatrixPath(file);
  Require(!path.keys.empty() && path.fps > 0 && path.size_px().minCoeff() > 0, "a path of nothing");
  for (const double v : path.object_px) Require(std::isfinite(v), "object_px");
  for (const MatrixKey& key : path.keys)
    Require(key.P.allFinite() && std::isfinite(key.view_scale) && key.filmed.allFinite() && key.steady.allFinite(),
            "a key is not finite");
}

}  // namespace lumi::fuzz
