// Progress as Python sees it: a callback, and remarks to the logger "lumigraph".
#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <mutex>
#include <string>
#include <utility>

#include "scene/program/error.h"
#include "scene/program/progress.h"

namespace lumi {

namespace py = pybind11;

// Called without the interpreter's lock, from whatever thread works. An exception of the callback, or Ctrl-C, ends the
// work at the next report.
class CallbackProgress final : public ProgressSink {
 public:
  // callback(task, done, total, seconds, seconds_left), the last two of them None where they are not known; or None.
  explicit CallbackProgress(py::object callback) : callback_(std::move(callback)) {}
  void Report(const std::string& task, long done, long total, double seconds, double seconds_left) override;
  void Finish(const std::string& task, long done, double seconds) override;
  void Message(const std::string& line) override;
  // What ended the work, where Python did.
  void RethrowOfPython();

 private:
  void Call(const std::string& task, long done, const py::object& total, double seconds, const py::object& left);
  py::object callback_;
  std::mutex mutex_;
  std::exception_ptr of_python_;
};

// body(sink) without the interpreter's lock: it touches no Python object.
template <typename Body>
auto WithProgress(py::object callback, Body&& body) {
  CallbackProgress sink(std::move(callback));
  auto result = [&] {
    try {
      const py::gil_scoped_release others_may_run;
      return body(sink);
    } catch (const Interrupted&) {
      sink.RethrowOfPython();
      throw;
    }
  }();
  sink.RethrowOfPython();  // of a report that came when all was done
  return result;
}

}  // namespace lumi
