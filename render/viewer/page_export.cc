#include "render/viewer/page_export.h"

#include <fmt/format.h>

#include "scene/program/sibling.h"

namespace lumi {
namespace {

struct PageSummary {
  double mb = 0;
};
void ListKeys(JsonKeys& j, PageSummary& s) { j("mb", s.mb); }

}  // namespace

class PageExport::Listener final : public ProgressSink {
 public:
  explicit Listener(PageExport& page) : page_(page) {}
  void Report(const std::string& task, long done, long total, double, double) override {
    page_.SayTask(total > 0 ? fmt::format("{} {}/{}", task, done, total) : task);
  }
  void Finish(const std::string& task, long, double) override { page_.SayTask(task); }
  void Message(const std::string&) override {}

 private:
  PageExport& page_;
};

PageExport::PageExport(std::filesystem::path scene, std::string proxy, std::string effects, std::filesystem::path file)
    : file_(std::move(file)),
      task_("web page"),
      thread_([this, scene = std::move(scene), proxy = std::move(proxy), effects = std::move(effects)] {
        Work(scene, proxy, effects);
      }) {}

PageExport::~PageExport() { thread_.join(); }

void PageExport::Work(const std::filesystem::path& scene, const std::string& proxy, const std::string& effects) {
  try {
    Listener listener(*this);
    std::vector<std::string> arguments{"web", scene.string(), "-o", file_.string(), "--effects", effects};
    if (!proxy.empty()) arguments.insert(arguments.end(), {"--proxy", proxy});
    mb_ = RunSibling({"lumi-export", arguments, "", ""}, listener).summary.As<PageSummary>().mb;
  } catch (...) {
    problem_ = std::current_exception();
  }
  ended_ = true;
}

void PageExport::SayTask(const std::string& task) {
  const std::lock_guard lock(mutex_);
  task_ = task;
}

std::string PageExport::task() const {
  const std::lock_guard lock(mutex_);
  return task_;
}

double PageExport::Result() const {
  if (problem_) std::rethrow_exception(problem_);
  return mb_;
}

}  // namespace lumi
