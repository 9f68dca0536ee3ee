#include "python/core/progress.h"

namespace lumi {

void CallbackProgress::Call(const std::string& task, long done, const py::object& total, double seconds,
                            const py::object& left) {
  {
    const std::lock_guard lock(mutex_);
    if (of_python_) return;
  }
  try {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!callback_.is_none()) callback_(task, done, total, seconds, left);
  } catch (py::error_already_set&) {
    const std::lock_guard lock(mutex_);
    if (!of_python_) of_python_ = std::current_exception();
  }
}

void CallbackProgress::Report(const std::string& task, long done, long total, double seconds, double seconds_left) {
  {
    const py::gil_scoped_acquire python;
    Call(task, done, total > 0 ? py::object(py::int_(total)) : py::none(), seconds,
         seconds_left >= 0 ? py::object(py::float_(seconds_left)) : py::none());
  }
  const std::lock_guard lock(mutex_);
  if (of_python_) throw Interrupted();
}

// Called while a task is taken down: it cannot throw.
void CallbackProgress::Finish(const std::string& task, long done, double seconds) {
  const py::gil_scoped_acquire python;
  Call(task, done, py::int_(done), seconds, py::float_(0.0));
}

void CallbackProgress::Message(const std::string& line) {
  const py::gil_scoped_acquire python;
  try {
    py::module_::import("logging").attr("getLogger")("lumigraph").attr("info")("%s", line);
  } catch (py::error_already_set& e) {
    e.discard_as_unraisable("a remark of lumigraph");
  }
}

void CallbackProgress::RethrowOfPython() {
  if (of_python_) std::rethrow_exception(of_python_);
}

}  // namespace lumi
