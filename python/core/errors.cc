#include <pybind11/pybind11.h>

#include <new>

#include "python/core/bind.h"
#include "scene/program/error.h"

namespace lumi {
namespace py = pybind11;
namespace {

// lumigraph.errors has a class a code of ours; what it makes of a failure is raised.
void Raise(int code, const std::string& message, const std::string& file, const std::string& hint) {
  const py::object error = py::module_::import("lumigraph.errors").attr("from_code")(code, message, file, hint);
  PyErr_SetObject(reinterpret_cast<PyObject*>(Py_TYPE(error.ptr())), error.ptr());
}

}  // namespace

void BindErrors(py::module_&) {
  py::register_exception_translator([](std::exception_ptr failure) {
    try {
      std::rethrow_exception(failure);
    } catch (const Error& e) {
      Raise(static_cast<int>(e.code()), e.what(), e.file().string(), e.hint());
    }
  });
}

}  // namespace lumi
