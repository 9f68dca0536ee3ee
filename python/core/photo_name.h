// Photos as Python names them: a string, whatever its bytes are on disk, or a position.
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <vector>

namespace lumi {

struct PhotoName {
  std::string text;
};
inline std::vector<std::string> TextsOf(const std::vector<PhotoName>& names) {
  std::vector<std::string> texts;
  for (const PhotoName& n : names) texts.push_back(n.text);
  return texts;
}
// As Python has names of files: bytes that are no UTF-8 are kept as surrogates.
inline pybind11::str ToPython(const std::string& name) {
  return pybind11::reinterpret_steal<pybind11::str>(
      PyUnicode_DecodeFSDefaultAndSize(name.data(), static_cast<Py_ssize_t>(name.size())));
}

}  // namespace lumi

namespace pybind11::detail {

template <>
struct type_caster<lumi::PhotoName> {
  PYBIND11_TYPE_CASTER(lumi::PhotoName, const_name("Union[str, int]"));
  bool load(handle from, bool) {
    if (PyLong_Check(from.ptr()) && !PyBool_Check(from.ptr())) {
      value.text = str(from).cast<std::string>();
      return true;
    }
    if (!PyUnicode_Check(from.ptr())) return false;
    const auto bytes_of_name = reinterpret_steal<bytes>(PyUnicode_EncodeFSDefault(from.ptr()));
    if (!bytes_of_name) {
      PyErr_Clear();
      return false;
    }
    value.text = bytes_of_name;
    return true;
  }
  static handle cast(const lumi::PhotoName& name, return_value_policy, handle) {
    return lumi::ToPython(name.text).release();
  }
};

}  // namespace pybind11::detail
