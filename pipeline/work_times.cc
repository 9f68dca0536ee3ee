#include "pipeline/work_times.h"

#include "scene/files/atomic_file.h"

namespace lumi {

static void ListKeys(JsonKeys& j, WorkTime& t) { j("seconds", t.seconds, "colmap_seconds", t.colmap_seconds); }
namespace {
struct NamedWorkTime {
  std::string stage;
  WorkTime time;
};
void ListKeys(JsonKeys& j, NamedWorkTime& n) { j(n.stage.c_str(), n.time); }
}  // namespace

WorkTimes::WorkTimes(const std::filesystem::path& scene)
    : scene_(scene), file_(scene / "provenance" / "pipeline-times.txt") {
  std::error_code error;
  if (std::filesystem::is_regular_file(file_, error)) times_ = JsonKeys::Parse(ReadText(file_)).value_or(JsonKeys());
}

WorkTime WorkTimes::Of(const std::string& stage, const WorkTime& fallback) const {
  NamedWorkTime named{stage, fallback};
  times_.Into(named);
  return named.time;
}

void WorkTimes::Keep(const std::string& stage, const WorkTime& time) {
  times_.Say(stage.c_str(), time);
  const FolderLock lock(scene_);
  WriteTextAtomically(file_, times_.Text());
}

}  // namespace lumi
