#include <pybind11/pybind11.h>

#include <filesystem>
#include <new>

#include "python/core/bind.h"
#include "python/core/photo_name.h"
#include "scene/program/error.h"
#include "scene/program/printable.h"

namespace lumi {
namespace py = pybind11;
namespace {

// lumigraph.errors has a class a code of ours; what it makes of a failure is raised.
void Raise(ExitCode code, const std::string& message, const std::string& file = {}, const std::string& hint = {}) {
  const py::object error =
      py::module_::import("lumigraph.errors")
          .attr("from_code")(static_cast<int>(code), Printable(message), ToPython(file), Printable(hint));
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(error.ptr())), error.ptr());
}

}  // namespace

// As Program::Run names failures; what is wrong with a value stays Python's ValueError.
void BindErrors(py::module_&) {
  py::register_exception_translator([](std::exception_ptr failure) {
    try {
      std::rethrow_exception(failure);
    } catch (const Error& e) {
      Raise(e.code(), e.what(), e.file().string(), e.hint());
    } catch (const std::bad_alloc&) {
      Raise(ExitCode::kMachine, "out of memory", {}, "use smaller photos or fewer of them");
    } catch (const std::filesystem::filesystem_error& e) {
      Raise(ExitCode::kMachine, e.code().message(), e.path1().string());
    }
  });
}

}  // namespace lumi
