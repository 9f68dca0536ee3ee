// What a stage recorded, and any other JSON object of ours that is read by its keys.
#include "scene/files/provenance.h"

#include "scene/files/json_keys.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {
namespace {

// A key of every type.
struct Inner {
  std::string name;
  JsonKeys rest;
};
struct EveryType {
  bool flag = false;
  int whole = 0;
  long more = 0;
  std::size_t count = 0;
  std::optional<double> number;
  std::filesystem::path file;
  std::vector<int> wholes;
  std::array<int, 2> pair{};
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  std::map<std::string, std::string> words;
  std::map<std::string, std::vector<double>> series;
  Inner inner;
  std::vector<Inner> list;
};
void ListKeys(JsonKeys& j, Inner& i) { j("name", i.name, "rest", i.rest); }
void ListKeys(JsonKeys& j, EveryType& e) {
  j("flag", e.flag, "whole", e.whole, "more", e.more, "count", e.count, "number", e.number, "file", e.file);
  j("wholes", e.wholes, "pair", e.pair, "vector", e.vector, "words", e.words, "series", e.series);
  j("inner", e.inner, "list", e.list);
}

}  // namespace

LUMI_FUZZ_TARGET(provenance) {
  const std::filesystem::path file = InputFile("recorded/provenance/stage.json", bytes);
  static_cast<void>(ReadProvenance(InputFolder() / "recorded", "stage"));
  const JsonKeys keys = JsonKeys::Read(file, "a summary");
  static_cast<void>(keys.Words());
  static_cast<void>(keys.Text(1));
  const std::string again = JsonKeys(keys.As<EveryType>()).Text();
  Require(JsonKeys(JsonKeys::Parse(again)->As<EveryType>()).Text() == again, "does not read back as it is written");
}

}  // namespace lumi::fuzz
