// What a stage recorded, and any other JSON object of ours that is read by its keys.
#include "scene/files/provenance.h"
#include "scene/files/json_keys.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(provenance) {
  const std::filesystem::path file = InputFile("recorded/provenance/stage.json", bytes);
  static_cast<void>(ReadProvenance(InputFolder() / "recorded", "stage"));
  const JsonKeys keys = JsonKeys::Read(file, "a summary");
  static_cast<void>(keys.Words());
  static_cast<void>(keys.Text(1));
  struct All {
    bool flag = false;
    int whole = 0;
    long more = 0;
    std::size_t count = 0;
    std::optional<double> number;
    std::vector<int> wholes;
    std::array<int, 2> pair{};
    Eigen::Vector3d vector;
    std::map<std::string, std::vector<double>> series;
    JsonKeys inner;
  } all;
  JsonKeys reading = keys;
  reading("flag", all.flag, "whole", all.whole, "more", all.more, "count", all.count, "number", all.number);
  reading("wholes", all.wholes, "pair", all.pair, "vector", all.vector, "series", all.series);
  reading("inner", all.inner);
  static_cast<void>(all.inner.Text());
}

}  // namespace lumi::fuzz
